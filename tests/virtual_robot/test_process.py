import math
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.episode import Outcome, Provenance
from twbal.core.errors import LinkError
from twbal.core.threads import cores
from twbal.link.protocol import Clock
from twbal.link.serial_plant import SerialPlant
from twbal.policies.policy import Policy
from twbal.virtual_robot.process import KeptRobots, VirtualRobotProcess, launch, virtual_robot_command

CONF = Path(__file__).parents[2] / "conf"
START = 60.0
PATIENCE = 30.0


class Linear(Policy):
    """u = 60 θ + 8 θ̇, which holds the nominal robot; `trap` is called at each step."""

    def __init__(self, trap=lambda step: None):
        self.trap = trap

    def controller(self, rng):
        steps = iter(range(10**9))

        def law(state):
            self.trap(next(steps))
            return float(60 * state[0] + 8 * state[1])

        return law


def drive(plant, trial=0, steps=50, policy=None):
    provenance = Provenance(plant.robot_name, "robot", trial=trial)
    channels = Channels(("tilt", "tilt_rate"), 0.15)
    return rollout(plant, policy or Linear(), channels, steps, math.radians(30), provenance)


def connect(port):
    return SerialPlant.open(port, 921600, PATIENCE, PATIENCE, PATIENCE)


def ends(pid):
    """Whether the process, a child of this one or not, ends before patience does."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        try:
            with open(f"/proc/{pid}/stat") as stat:
                if stat.read().rpartition(")")[2].split()[0] == "Z":
                    return True
        except FileNotFoundError:
            return True
        time.sleep(0.02)
    return False


def virtual(clock="lockstep", seed=3, overrides=()):
    cfg = OmegaConf.load(CONF / "groups" / "link.yaml").virtual
    cfg.update(robot="paper", seed=seed, clock=clock, overrides=[*cfg.overrides, *overrides])
    return instantiate(cfg)


@pytest.mark.slow
def test_one_seed_and_trial_is_the_same_episode_in_every_process():
    episodes = []
    for seed in (3, 3, 4):
        with virtual(seed=seed) as plant:
            episodes.append([drive(plant, trial) for trial in (0, 1, 0)])
            assert plant.clock is Clock.LOCKSTEP
            assert (plant.robot_name, plant.torque_limit, plant.control_period) == ("paper", 20.0, 0.02)
    (first, other, again), (repeated, _, _), (stranger, _, _) = episodes
    np.testing.assert_array_equal(first.observations, again.observations)
    np.testing.assert_array_equal(first.observations, repeated.observations)
    assert first.tilt[0] != other.tilt[0]
    assert first.tilt[0] != stranger.tilt[0]


def test_a_robot_killed_in_mid_rollout_leaves_the_episode_so_far_and_its_last_words():
    robot = VirtualRobotProcess.ready(virtual_robot_command(["faults=none"]), START)

    def kill(step):
        if step == 10:
            os.kill(robot.pid, signal.SIGKILL)
            assert ends(robot.pid)

    try:
        with connect(robot.port) as plant:
            episode = drive(plant, policy=Linear(kill))
            assert (len(episode), episode.outcome) == (10, Outcome.LINK_LOST)
            assert "gone" in episode.events[-1].text
            with pytest.raises(LinkError):
                plant.reset(1)
        assert "exit code -9" in robot.last_words()
    finally:
        robot.close()


def test_real_time_keeps_the_robots_own_time():
    with virtual("real_time", overrides=["faults=none", "self_stop_tilt=3"]) as plant:
        assert plant.clock is Clock.REAL_TIME
        begun = time.monotonic()
        episode = drive(plant, steps=25)
        passed = time.monotonic() - begun
    assert len(episode) > 5
    assert episode.observations[-1, 0] <= passed
    periods = np.diff(episode.observations[:, 0]) / 0.02
    np.testing.assert_allclose(periods, np.round(periods), atol=1e-6)
    assert periods.sum() - len(periods) == pytest.approx(plant.missed_periods)


def test_a_robot_that_does_not_start_is_an_error_with_its_own_words():
    with (
        pytest.raises(LinkError, match=r"did not start(.|\n)*no_such_setting"),
        launch(virtual_robot_command(["no_such_setting=1"]), START),
    ):
        pass


def test_a_robot_that_says_nothing_is_an_error():
    with (
        pytest.raises(LinkError, match=r"did not say its port within 0\.2 s"),
        launch([sys.executable, "-c", "import time; time.sleep(60)"], 0.2),
    ):
        pass


def test_a_lost_link_to_a_dead_robot_says_how_it_died():
    dying = "import sys; print('noise'); print('port /dev/null', flush=True); sys.exit('battery flat')"
    with (
        pytest.raises(LinkError, match=r"no answer(.|\n)*exit code 1(.|\n)*battery flat"),
        launch([sys.executable, "-c", dying], START) as port,
    ):
        assert port == "/dev/null"
        raise LinkError("no answer.")


def running(word):
    """Numbers of the processes that were started with a word."""
    found = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # it ended
            found += [file.parent.name] if word.encode() in file.read_bytes().split(b"\0") else []
    return found


def test_other_errors_pass_and_the_robot_ends_with_the_body():
    seed = "seed=51966"
    with pytest.raises(ZeroDivisionError), launch(virtual_robot_command([seed]), START) as port:
        assert os.path.exists(port)
        assert len(running(seed)) == 1
        raise ZeroDivisionError
    assert not running(seed)  # the name of its port may be another terminal's by now


def test_asked_to_end_it_ends_cleanly():
    robot = subprocess.Popen(virtual_robot_command([]), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert "port /dev/" in robot.stdout.readline()
    robot.terminate()
    _, complaints = robot.communicate(timeout=PATIENCE)
    assert (robot.returncode, complaints) == (0, "")


def test_it_ends_when_its_host_has_gone_for_long_and_not_when_the_next_one_comes():
    robot = VirtualRobotProcess.ready(virtual_robot_command(["idle_timeout=1"]), START)
    for _ in range(2):
        with connect(robot.port) as plant:
            plant.reset(0)
    assert ends(robot.pid)
    assert "exit code 0" in robot.last_words()
    robot.close()


def test_it_ends_when_the_process_that_started_it_was_killed():
    starter = (
        "import sys, time\n"
        "from twbal.virtual_robot.process import VirtualRobotProcess, virtual_robot_command\n"
        f"robot = VirtualRobotProcess.ready(virtual_robot_command([]), {START})\n"
        "print(robot.pid, flush=True)\n"
        "time.sleep(600)\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", starter], stdout=subprocess.PIPE, text=True)
    pid = int(parent.stdout.readline())
    parent.kill()
    parent.communicate()
    assert ends(pid)


def test_an_unknown_clock_is_an_error_that_lists_them():
    with (
        pytest.raises(LinkError, match=r"clock=sundial; expected one of: lockstep, real_time"),
        launch(virtual_robot_command(["clock=sundial"]), START),
    ):
        pass


def test_a_kept_robot_starts_once_and_does_what_a_fresh_one_does():
    command = virtual_robot_command(["robot=paper", "seed=3"])
    episodes, ports = [], []
    with KeptRobots() as kept:
        for _ in range(2):
            with kept.launch(command, START) as port, connect(port) as plant:
                ports.append(port)
                episodes.append([drive(plant, trial) for trial in (0, 1)])
        assert ports[0] == ports[1]
        pid = kept._free[0].pid
    assert ends(pid)  # its port may be another's by now
    with launch(command, START) as port, connect(port) as plant:
        episodes.append([drive(plant, trial) for trial in (0, 1)])
    for first, second, fresh in zip(*episodes, strict=True):
        np.testing.assert_array_equal(first.observations, fresh.observations)
        np.testing.assert_array_equal(second.observations, fresh.observations)


def test_a_kept_robot_is_another_for_another_command():
    with KeptRobots() as kept:
        pids = [pid_of(kept, ["seed=3"]), pid_of(kept, ["seed=3"]), pid_of(kept, ["seed=4"])]
        assert pids[0] == pids[1] != pids[2]
        assert ends(pids[0])
    assert ends(pids[2])


def test_bodies_within_each_other_have_a_robot_each_and_both_are_kept():
    with KeptRobots() as kept:
        with kept.launch(talking([]), START) as one, kept.launch(talking([]), START) as other:
            assert one != other
        with kept.launch(talking([]), START) as one_again, kept.launch(talking([]), START) as other_again:
            assert {one_again, other_again} == {one, other}
    assert ends(int(one))
    assert ends(int(other))


def test_robots_that_were_begun_are_those_that_are_launched():
    with KeptRobots() as kept:
        kept.begin(talking([]), 2)
        pids = {process.pid for process in kept._free}
        with kept.launch(talking([]), START) as one, kept.launch(talking([]), START) as other:
            assert {int(one), int(other)} == pids
    assert all(map(ends, pids))


def test_robots_are_ready_where_so_many_of_the_command_are_kept_and_run():
    command = talking([])
    with KeptRobots() as robots:
        assert not robots.are_ready(command, 1, START)
        robots.begin(command, 2)
        assert robots.are_ready(command, 2, START)
        assert all(process.port for process in robots._free)
        assert not robots.are_ready(command, 3, START)
        assert not robots.are_ready(["another"], 1, START)


def test_robots_that_cannot_start_are_not_ready_and_told_of_later():
    command = virtual_robot_command(["clock=sundial"])
    with KeptRobots() as robots:
        robots.begin(command, 1)
        assert not robots.are_ready(command, 1, START)


BY_A_COPY = """
import os, sys
from pathlib import Path
from twbal.core.copies import begun_ahead
from twbal.virtual_robot.process import KeptRobots, virtual_robot_command
file = Path(sys.argv[1])

def launched():
    with robots.launch(virtual_robot_command(["seed=3"]), 60.0) as port:
        file.write_text(port)
    robots.close()

with KeptRobots() as robots:
    robots.begin(virtual_robot_command(["seed=3"]), 1)
    robots.are_ready(virtual_robot_command(["seed=3"]), 1, 60.0)
    with begun_ahead(launched):
        pass
    with robots.launch(virtual_robot_command(["seed=3"]), 60.0) as port:
        print(port == file.read_text())
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir() or cores() < 2, reason="copies are made on Linux")
def test_a_copy_of_the_process_drives_its_robots_and_leaves_them_running(tmp_path):
    words = [sys.executable, "-c", BY_A_COPY, str(tmp_path / "port")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    assert (done.stdout, done.stderr) == ("True\n", "")


def test_robots_that_were_begun_and_never_launched_end():
    with KeptRobots() as kept:
        kept.begin(talking([]), 1)
        pid = kept._free[0].pid
    assert ends(pid)


def test_a_robot_that_was_begun_and_cannot_start_is_told_of_when_it_is_launched():
    command = virtual_robot_command(["clock=sundial"])
    with KeptRobots() as kept:
        kept.begin(command, 1)
        with pytest.raises(LinkError, match=r"did not start.*clock=sundial"), kept.launch(command, START):
            pass
        assert not kept._free


@pytest.mark.parametrize("error", [LinkError("no answer."), ZeroDivisionError("any")], ids=["link", "other"])
def test_a_kept_robot_with_which_something_failed_is_not_used_again(error):
    with KeptRobots() as kept:
        pid = pid_of(kept, [])
        with pytest.raises(type(error), match=str(error)), kept.launch(talking([]), START):
            raise error
        assert ends(pid)
        assert pid_of(kept, []) != pid


def test_a_kept_robot_that_has_ended_is_started_anew():
    with KeptRobots() as kept:
        pid = pid_of(kept, [])
        os.kill(pid, signal.SIGKILL)
        assert ends(pid)
        assert pid_of(kept, []) != pid


def talking(words):
    """The command line of a process that says its number for its port, as no test here opens that."""
    program = "import os, time; print('port', os.getpid(), flush=True); time.sleep(600)"
    return [sys.executable, "-c", program, *words]


def pid_of(kept, words):
    with kept.launch(talking(words), START) as port:
        return int(port)
