import os
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from twbal.algorithm.collection import RolloutPlan, collect
from twbal.core.channels import Channels
from twbal.core.episode import Outcome, Provenance
from twbal.core.errors import ConfigError
from twbal.core.plant import Observation, Plant
from twbal.policies.random import RandomPolicy


class Cart(Plant):
    """Rolls as it is commanded; its start is its trial's number."""

    def __init__(self, control_period: float, impatient: bool = False):
        self.control_period = control_period
        self._impatient = impatient

    def reset(self, trial):
        self._time, self._place = 0.0, float(trial)
        return self._seen()

    def step(self, command):
        if self._impatient:
            raise KeyboardInterrupt
        self._time += self.control_period
        self._place += self.control_period * command
        return self._seen()

    def stop(self):
        """It has no motors."""

    def close(self):
        """It holds nothing."""

    def _seen(self):
        return Observation(self._time, 0.01 * self._place, 0.0, 0.0, self._place, 0.0, 0.0)


def trials(count):
    return [Provenance("cart", "simulation", seed=3, trial=trial) for trial in range(count)]


def plan(impatient=False):
    policy = RandomPolicy(amplitude=0.5, torque_limit=2.0, hold=2)
    return RolloutPlan(partial(Cart, 0.02, impatient), policy, Channels(("tilt", "command_1"), 0.1), 6, 0.5)


def test_rollouts_come_in_order_and_differ():
    episodes = list(collect(plan(), trials(4), workers=1))
    assert [episode.provenance.trial for episode in episodes] == [0, 1, 2, 3]
    assert all(len(episode) == 6 and episode.outcome is Outcome.COMPLETED for episode in episodes)
    assert len({episode.commands.tobytes() for episode in episodes}) == 4


def test_processes_make_the_same_rollouts():
    one, two = (list(collect(plan(), trials(60), workers)) for workers in (1, 2))
    assert [episode.provenance for episode in one] == [episode.provenance for episode in two]
    assert all(np.array_equal(a.observations, b.observations) for a, b in zip(one, two, strict=True))
    assert all(np.array_equal(a.commands, b.commands) for a, b in zip(one, two, strict=True))


def test_ctrl_c_ends_the_collection_not_just_the_rollout():
    with pytest.raises(KeyboardInterrupt):
        list(collect(plan(impatient=True), trials(4), workers=1))


def test_a_negative_number_of_processes_is_refused():
    with pytest.raises(ConfigError, match="found -1"):
        list(collect(plan(), trials(1), workers=-1))


def children_of(process):
    """Numbers of the processes that a process has started."""
    return Path(f"/proc/{process}/task/{process}/children").read_text().split()


def is_there(process):
    """Whether a process works or waits (Z: it has ended, and nobody has asked how)."""
    stat = Path(f"/proc/{process}/stat")
    return stat.exists() and stat.read_text().rpartition(")")[2].split()[0] != "Z"


def wait_until(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_no_process_outlives_a_command_that_was_killed(tmp_path):
    words = ("sim-collect", "rollouts=20000", "workers=2", f"hydra.run.dir={tmp_path / 'run'}")
    command = subprocess.Popen([sys.executable, "-m", "twbal.cli.main", *words], stdout=subprocess.DEVNULL)
    wait_until(lambda: len(children_of(command.pid)) == 3)  # multiprocessing has one of its own, which ends by itself
    children = children_of(command.pid)
    command.kill()
    command.wait()
    wait_until(lambda: not any(map(is_there, children)), 20.0)


UNGUARDED = """
import sys
sys.path.insert(0, sys.argv[1])
from test_collection import Cart, plan, trials
from twbal.algorithm.collection import collect
print("read")
found = list(collect(plan(), trials(60), workers=2))
expected = list(plan().drive(trials(60)))
same = [a.observations.tobytes() + a.commands.tobytes() for a in found] == [
    b.observations.tobytes() + b.commands.tobytes() for b in expected
]
print(len(found), same, [each.provenance.trial for each in found] == list(range(60)))
"""


def test_a_script_that_does_its_work_as_it_is_read_gets_the_same_rollouts(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(UNGUARDED)
    words = [sys.executable, str(script), str(Path(__file__).parent)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("60 True True\n")  # after what its processes wrote before they were ended
    assert 'Put what the module does under `if __name__ == "__main__":`' in done.stderr
    assert "Traceback" not in done.stderr


class DyingCart(Cart):
    """Ends a process that is not the one which made the plan, as one does that is out of memory."""

    def __init__(self, control_period: float, maker: int):
        super().__init__(control_period)
        self._maker = maker

    def reset(self, trial):
        if os.getpid() != self._maker and trial >= 40:
            os._exit(9)
        return super().reset(trial)


def test_what_processes_leave_undone_is_done_here():
    dying = replace(plan(), make_plant=partial(DyingCart, 0.02, os.getpid()))
    one, left = list(collect(plan(), trials(60), workers=1)), list(collect(dying, trials(60), workers=2))
    assert [episode.provenance for episode in one] == [episode.provenance for episode in left]
    assert all(np.array_equal(a.observations, b.observations) for a, b in zip(one, left, strict=True))
