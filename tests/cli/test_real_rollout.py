import gc
import os
import signal
import tempfile
from contextlib import closing, contextmanager

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate

from twbal.algorithm.rollout import rollout
from twbal.algorithm.settings import RolloutSettings
from twbal.cli import kept_episodes
from twbal.cli.composition import composing
from twbal.cli.conf_folder import conf_folder
from twbal.cli.kept_episodes import what_is_kept
from twbal.cli.main import main
from twbal.cli.robot_link import in_time
from twbal.cli.stages.real_rollout import record
from twbal.core.course import Standing
from twbal.core.episode import Outcome, Provenance
from twbal.core.errors import DataError, LinkLostError
from twbal.io.checkpoint import save_checkpoint
from twbal.io.logs import read_episode, write_episode
from twbal.link.protocol import Clock
from twbal.link.serial_plant import SerialPlant
from twbal.policies.linear import LinearPolicy
from twbal.policies.policy import Policy
from twbal.virtual_robot.process import VirtualRobotProcess, virtual_robot_command

pytestmark = pytest.mark.usefixtures("kept_robots")


class Trap(Policy):
    """Commands nothing, and at its fifth step does something else."""

    def __init__(self, act):
        self._act = act

    def controller(self, rng: np.random.Generator):
        steps = iter(range(100))

        def law(state):
            if next(steps) == 5:
                self._act()
            return 0.0

        return law


@contextmanager
def watched(link, events):
    """The plant of `link`, whose arming, stops and leaving are put down in `events`."""
    with instantiate(link) as plant:
        reset, stop = plant.reset, plant.stop
        plant.reset = lambda trial: events.append("reset") or reset(trial)
        plant.stop = lambda: events.append("stop") or stop()
        try:
            yield plant
        finally:
            events.append("left")


@pytest.fixture
def cfg():
    with composing():
        return compose("real_rollout", ["policy=random", "steps=8", "trials=2"])


def drive(cfg, policy, out, open_link, **more):
    bare = {"exploration": 0.0, "exploration_steps": None}
    settings = RolloutSettings(seed=0, trials=2, first_trial=0, steps=8, tilt_limit=0.5, **bare)
    provenance = Provenance("paper", "robot")
    return record(open_link, instantiate(cfg.robot), policy, instantiate(cfg.state), settings, provenance, out, **more)


def test_only_a_robot_in_real_time_is_answered_without_garbage_collection(cfg, tmp_path, capsys, monkeypatch):
    collects = []

    @contextmanager
    def link():
        with instantiate(cfg.link) as plant:
            with in_time(plant):  # which is in lockstep
                collects.append(gc.isenabled())
            plant.clock = Clock.REAL_TIME  # as a robot may announce
            yield plant

    def refuse(*asked):
        raise PermissionError("as to most people")

    monkeypatch.setattr("os.sched_setscheduler", refuse)
    drive(cfg, Trap(lambda: collects.append(gc.isenabled())), tmp_path, link)
    assert collects == [True, False, False]
    assert gc.isenabled()
    assert capsys.readouterr().out.count("this command has no real-time priority") == 1


def test_each_trial_is_told_as_soon_as_it_is_logged(cfg, tmp_path):
    logs_then = []

    def tell(episode):
        logs_then.append((episode.provenance.trial, len(list((tmp_path / "episodes").iterdir()))))

    drive(cfg, Trap(lambda: None), tmp_path, lambda: instantiate(cfg.link), tell=tell)
    assert logs_then == [(0, 1), (1, 2)]


@pytest.fixture
def targets_given(monkeypatch):
    """The targets of each rollout that the stage drives."""
    given = []

    def watched(*asked, **more):
        given.append(asked[6])
        return rollout(*asked, **more)

    monkeypatch.setattr("twbal.cli.stages.real_rollout.rollout", watched)
    return given


@pytest.mark.parametrize(
    ("asked", "robot", "state", "yields"),
    [
        ("true", "paper", "default", True),
        ("false", "balboa", "default", False),
        ("null", "paper", "default", False),
        ("null", "balboa", "default", True),
        ("true", "paper", "paper", False),
    ],
)
def test_only_a_robot_that_is_to_yield_and_sees_its_place_has_a_reference_that_can_move(
    asked, robot, state, yields, tmp_path, targets_given
):
    """The policy of the state `paper` does not know where it is."""
    words = [f"policy.path={tmp_path / 'policy.pt'}", "steps=3", f"robot={robot}", f"state={state}"]
    with composing():
        names = instantiate(compose("real_rollout", words).state).names
    still = LinearPolicy(names, np.zeros(len(names)), 0.0, 0.1)
    save_checkpoint(tmp_path / "policy.pt", "policy", still.to_payload())
    assert main(["real-rollout", *words, f"yield_to_pushes={asked}", f"hydra.run.dir={tmp_path / 'out'}"]) == 0
    assert [type(targets) for targets in targets_given] == [Standing if yields else type(None)]


@pytest.mark.parametrize("blind", ["policy=random", "policy=excite", "experiment=excite"])
def test_a_test_signal_is_no_push(blind, tmp_path, targets_given):
    words = [blind, "robot=balboa", "steps=3", "trials=1", f"hydra.run.dir={tmp_path}"]
    assert main(["real-rollout", *words]) == 0
    assert targets_given == [None]


@pytest.mark.slow
def test_a_robot_that_nobody_pushes_is_driven_the_same_whether_it_would_yield_or_not(tmp_path):
    """Beside the settings that they are recorded with, the logs are the same."""
    made = []
    for yields in ("true", "false"):
        out = tmp_path / yields
        words = ["policy=excite", "policy.speed=0", "policy.multisine=0", "policy.prbs=0", "steps=100"]
        upright = 'link.overrides=["faults=none","start.tilt_mean=0"]'
        assert main(["real-rollout", *words, upright, f"yield_to_pushes={yields}", f"hydra.run.dir={out}"]) == 0
        made.append(read_episode(out / "episodes" / "trial_000.mcap"))
    assert made[0].references is made[1].references is None
    assert made[0].states.tobytes() == made[1].states.tobytes()


def test_trials_that_were_driven_before_are_told_as_such(tmp_path, capsys):
    words = ["policy=random", "steps=3", f"hydra.run.dir={tmp_path}"]
    assert main(["real-rollout", *words, "trials=1"]) == 0
    assert "trial 0: completed after 0.06 s, 3 samples\n" in capsys.readouterr().out
    assert main(["real-rollout", *words, "trials=1"]) == 0
    assert "trial 0: completed after 0.06 s, 3 samples, driven before\n" in capsys.readouterr().out


def test_ctrl_c_keeps_what_there_is_says_that_the_motors_are_off_and_ends_the_stage(cfg, tmp_path, capsys):
    def press():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        drive(cfg, Trap(press), tmp_path, lambda: instantiate(cfg.link))
    said = capsys.readouterr().out
    assert "The robot confirmed that its motors are off. 5 samples of trial 0 are kept in" in said
    (kept,) = tmp_path.rglob("*.mcap")
    assert kept == tmp_path / "interrupted" / "trial_000_stopped_0.mcap"
    episode = read_episode(kept)
    assert (episode.outcome, len(episode)) == (Outcome.STOPPED, 5)
    files = drive(cfg, Trap(lambda: None), tmp_path, lambda: instantiate(cfg.link))  # the same work again
    assert files == sorted((tmp_path / "episodes").iterdir())
    assert all(len(read_episode(file)) == 8 for file in files)
    assert kept.exists()


def test_ctrl_c_while_a_trial_is_logged_loses_nothing_of_it(cfg, tmp_path, monkeypatch):
    pressed = []

    def press_once(path, episode):
        if not pressed:
            pressed.append(path)
            raise KeyboardInterrupt
        write_episode(path, episode)

    monkeypatch.setattr("twbal.cli.kept_episodes.write_episode", press_once)
    with pytest.raises(KeyboardInterrupt):
        drive(cfg, Trap(lambda: None), tmp_path, lambda: instantiate(cfg.link))
    assert list(tmp_path.rglob("*.mcap")) == pressed == [tmp_path / "episodes" / "trial_000.mcap"]
    assert len(read_episode(pressed[0])) == 8


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The temporary folder."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def test_a_trial_that_cannot_be_logged_is_an_error_the_robot_is_off_and_the_trial_is_kept_elsewhere(
    cfg, tmp_path, temporary
):
    (tmp_path / "episodes").write_text("a file where a folder belongs")
    events = []
    said = r"Cannot write .*trial_000\.mcap.* Is there room.* 8 samples of trial 0 are kept in .*: move that to"
    with pytest.raises(DataError, match=said):
        drive(cfg, Trap(lambda: None), tmp_path, lambda: watched(cfg.link, events))
    assert events[: events.index("left")] == ["reset", "stop"]
    (log,) = temporary.rglob("*.mcap")
    assert (log.name, len(read_episode(log))) == ("trial_000.mcap", 8)


def test_a_trial_that_cannot_be_logged_anywhere_is_said_to_be_lost(cfg, tmp_path, temporary, monkeypatch):
    def full(file, episode):
        raise DataError(f"Cannot write {file}.")

    monkeypatch.setattr(kept_episodes, "write_episode", full)
    with pytest.raises(DataError, match=r"Cannot write .*trial_000\.mcap\. 8 samples of trial 0 are lost\.$"):
        drive(cfg, Trap(lambda: None), tmp_path, lambda: instantiate(cfg.link))
    assert not list(temporary.iterdir())
    monkeypatch.setattr(kept_episodes, "mkdtemp", lambda prefix: os.mkdir(tmp_path / "nowhere" / prefix))
    with pytest.raises(DataError, match=r"8 samples of trial 0 are lost\.$"):
        drive(cfg, Trap(lambda: None), tmp_path, lambda: instantiate(cfg.link))


def test_ctrl_c_in_a_trial_that_cannot_be_logged_ends_the_stage_as_ever(cfg, tmp_path, capsys, temporary):
    def press():
        raise KeyboardInterrupt

    (tmp_path / "interrupted").write_text("a file where a folder belongs")
    with pytest.raises(KeyboardInterrupt):
        drive(cfg, Trap(press), tmp_path, lambda: instantiate(cfg.link))
    (log,) = temporary.rglob("*.mcap")
    said = capsys.readouterr().out
    assert "Cannot write" in said
    assert f"5 samples of trial 0 are kept in {log}: move that to" in said
    assert len(read_episode(log)) == 5


def test_a_policy_that_commands_no_number_ends_the_stage_and_the_trial_so_far_is_kept(cfg, tmp_path):
    class Broken(Policy):
        def controller(self, rng):
            commands = iter([0.0] * 5)
            return lambda state: next(commands, float("nan"))

    with pytest.raises(DataError, match=r"The policy commands nan N·m.* 5 samples of trial 0 are kept in"):
        drive(cfg, Broken(), tmp_path, lambda: instantiate(cfg.link))
    episode = read_episode(tmp_path / "interrupted" / "trial_000_policy_fault_0.mcap")
    assert (episode.outcome, len(episode)) == (Outcome.POLICY_FAULT, 5)


def test_a_robot_may_have_a_name_of_its_own_and_the_episode_bears_it(cfg, tmp_path):
    cfg.link.overrides = [*cfg.link.overrides, "robot.name=bob"]
    files = drive(cfg, Trap(lambda: None), tmp_path, lambda: instantiate(cfg.link))
    assert {read_episode(file).provenance.robot for file in files} == {"bob"}


def test_a_virtual_robot_finds_a_sheet_of_ones_own(tmp_path):
    folder = tmp_path / "mine" / "robot"
    folder.mkdir(parents=True)
    text = (conf_folder() / "robot" / "paper.yaml").read_text()
    (folder / "mine.yaml").write_text(text.replace("name: paper", "name: mine").replace("0.02 ", "0.01 "))
    words = ["robot=mine", "policy=random", "trials=1", "steps=3", f"hydra.run.dir={tmp_path / 'run'}"]
    assert main(["real-rollout", f"--config-dir={tmp_path / 'mine'}", *words]) == 0
    episode = read_episode(tmp_path / "run" / "episodes" / "trial_000.mcap")
    assert (episode.provenance.robot, episode.control_period) == ("mine", 0.01)


def test_a_robot_killed_in_mid_rollout_leaves_an_episode_marked_link_lost(cfg, tmp_path):
    patience = 30.0
    with closing(VirtualRobotProcess.ready(virtual_robot_command([]), patience)) as robot:
        kill = Trap(lambda: os.kill(robot.pid, signal.SIGKILL))
        with pytest.raises(LinkLostError, match=r"5 samples of trial 0 are kept in .*marked link lost"):
            drive(cfg, kill, tmp_path, lambda: SerialPlant.open(robot.port, 921600, patience, patience, patience))
    episode = read_episode(tmp_path / "interrupted" / "trial_000_link_lost_0.mcap")
    assert (episode.outcome, len(episode)) == (Outcome.LINK_LOST, 5)
    assert episode.events
    assert not list((tmp_path / "episodes").glob("*"))


def test_what_a_start_that_was_cut_short_left_is_said_as_it_is(tmp_path):
    """That the next start says so is shown by hosts that are killed, in tests/benchmarks/test_link_faults.py."""
    assert what_is_kept(tmp_path) == "an earlier start was cut short; nothing of it is kept"
    for name in ("episodes/trial_000", "episodes/trial_001", "interrupted/trial_002_link_lost_0"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / f"{name}.mcap").touch()
    assert what_is_kept(tmp_path) == "an earlier start was cut short; trials kept: 2 whole, 1 interrupted"


def test_a_policy_beside_another_programs_manifest_is_driven_to_the_end(tmp_path, capsys):
    policy = LinearPolicy(("tilt", "tilt_rate", "speed", "command_1", "command_2"), np.zeros(5), 0.0, 1.0)
    save_checkpoint(tmp_path / "policy.pt", "policy", policy.to_payload())
    (tmp_path / "manifest.json").write_text('{"name": "of another program"}')
    words = [f"policy.path={tmp_path / 'policy.pt'}", f"hydra.run.dir={tmp_path / 'run'}", "trials=1", "steps=3"]
    assert main(["real-rollout", "state=rolling", *words]) == 0
    assert "next  twbal real-rollout experiment=excite" in capsys.readouterr().out  # three steps tell nothing
