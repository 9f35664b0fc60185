"""What cannot work ends in one clear line, a non-zero exit and nothing lost, as seen by who types the command.

The same properties are tested one floor down, more densely: of logs in logs/test_logs.py, of checkpoints in
test_checkpoint.py, of the link in link/test_serial_plant.py, of settings in settings/ and stages/test_checking.py;
misspelt settings in test_cli.py, too few samples and a port that is not there in stages/test_chain.py.
"""

import hashlib
import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from mcap.writer import Writer
from served import served

from twbal.cli.main import STAGES, main
from twbal.core.episode import Outcome
from twbal.io.logs import read_episode, write_episode
from twbal.link.decoder import Decoder, to_wire
from twbal.link.message import Message
from twbal.link.protocol import Clock, Status, Telemetry, Welcome
from twbal.policies.policy import Policy
from twbal.virtual_robot.firmware import Firmware, Identity
from twbal.virtual_robot.process import VirtualRobotProcess, virtual_robot_command

QUICK_F = "model.fit_f.settings.fit.starts=1"
QUICK_G = "model.fit_g.settings.starts=1"


pytestmark = pytest.mark.usefixtures("as_from_a_shell")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with episodes in simulation (sim), and a model of them (f)."""
    folder, before = tmp_path_factory.mktemp("made"), sys.argv
    try:
        assert main(["sim-collect", f"hydra.run.dir={folder / 'sim'}", "rollouts=4", "steps=12"]) == 0
        assert main(["fit-sim-gp", f"hydra.run.dir={folder / 'f'}", f"episodes={folder / 'sim'}", QUICK_F]) == 0
    finally:
        sys.argv = before
    return folder


@pytest.fixture
def log(made):
    """The log of one episode."""
    return made / "sim" / "episodes" / "trial_000.mcap"


@pytest.fixture
def refused(capfd) -> Callable[..., str]:
    """Runs a command that must fail, and returns the one line that it says on stderr."""

    def run(*words: str) -> str:
        capfd.readouterr()
        assert main(list(words)) == 1
        said = [line for line in capfd.readouterr().err.splitlines() if "pybullet build time" not in line]
        assert len(said) == 1, said
        assert said[0].startswith("twbal: error: ")
        return said[0]

    return run


def content(folder: Path) -> dict[Path, str]:
    return {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.rglob("*") if path.is_file()}


# Words that are not known

DRAWS_NOTHING = {  # a setting of stages without a seed
    "identify": "episodes",
    "diagnose": "bins",
    "import-log": "period",
    "plot": "resync",
    "regress": "baseline",
    "export": "format",
    "repair": "logs",
    "lqr": "episodes",
    "new-robot": "folder",
    "doctor": "timing",
    "check-link": "exchanges",
}


@pytest.mark.parametrize("stage", STAGES)
def test_every_stage_refuses_a_misspelt_override_and_names_the_near_one(stage, refused, tmp_path):
    known = DRAWS_NOTHING.get(stage, "seed")
    said = refused(stage, f"{known}x=1")
    assert f"no setting '{known}x' (did you mean '{known}'?)" in said
    assert f"`twbal {stage} --cfg job` shows all" in said
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("stage", "word", "choices"),
    [
        ("iterate", "experiment=mine", "drive, excite, paper"),
        ("fit-sim-gp", "model=dense", "exact, sparse, variational"),
        ("optimise-policy", "cost=cheap", "default, paper"),
        ("real-rollout", "link=radio", "firmware, serial, virtual"),
        ("virtual-robot", "faults=all", "hard, light, moderate, none"),
    ],
)
def test_an_unknown_choice_lists_those_that_there_are(stage, word, choices, refused, tmp_path):
    group, choice = word.split("=")
    said = refused(stage, word)
    assert f"{group} has no choice {choice!r}" in said
    assert said.endswith(f"The choices are: {choices}.")
    assert not list(tmp_path.iterdir())


def test_output_that_has_no_room_is_an_error_in_one_line(made, tmp_path):
    words = [sys.executable, "-m", "twbal", "export", f"episodes={made / 'sim'}", "hydra.run.dir=out"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with open("/dev/full", "w") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path, env=environment)
    assert done.returncode == 1
    assert done.stderr == (
        "twbal: error: Cannot write the output: No space left on device. Is there room on the disk?\n"
    )


@pytest.mark.parametrize(
    ("stage", "choice", "of_another"),
    [
        ("iterate", "excite", "sets steps, and iterate has no such setting"),
        ("real-rollout", "paper", "chooses a cost, and real-rollout has no cost"),
    ],
)
def test_an_experiment_of_another_stage_is_refused_before_anything_is_done(
    stage, choice, of_another, refused, tmp_path
):
    said = refused(stage, f"experiment={choice}", "hydra.run.dir=run")
    assert f"experiment={choice} {of_another}. Is the experiment one of another stage?" in said
    assert not list(tmp_path.rglob("*.mcap"))


def test_a_shell_sees_the_same(tmp_path):
    words = [sys.executable, "-m", "twbal", "sim-collect", "rolouts=3"]
    environment = {name: value for name, value in os.environ.items() if name not in ("HYDRA_FULL_ERROR", "TWBAL_DEBUG")}
    environment["PYTHONPATH"] = os.pathsep.join(sys.path)
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert (done.returncode, done.stdout) == (1, "")
    (said,) = done.stderr.splitlines()
    assert said.startswith("twbal: error: sim-collect has no setting 'rolouts' (did you mean 'rollouts'?)")


# Files that cannot be used


def fit_f(episodes: Path) -> list[str]:
    return ["fit-sim-gp", "hydra.run.dir=out", f"episodes={episodes}", QUICK_F]


def fit_g(made: Path, episodes: Path) -> list[str]:
    return ["fit-diff-gp", "hydra.run.dir=out", f"dynamics={made / 'f' / 'model.pt'}", f"episodes={episodes}", QUICK_G]


def test_a_missing_episode_folder_is_named(made, refused, tmp_path):
    expected = "none is not there. Give the run folder of a stage that records episodes, or a folder of logs."
    assert expected in refused(*fit_f(tmp_path / "none"))
    assert expected in refused(*fit_g(made, tmp_path / "none"))


@pytest.mark.parametrize("kept", [0, 1, 8, 100, 0.25, 0.5, 0.75, 0.999, -1])
def test_a_log_cut_anywhere_is_refused_and_left_as_it_is(kept, log, refused, tmp_path):
    whole = log.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(kept * len(whole)) if isinstance(kept, float) else kept])
    before = cut.read_bytes()
    said = refused(*fit_f(cut))
    assert str(cut) in said
    assert "cut" in said.replace(str(cut), "") or "empty" in said
    assert cut.read_bytes() == before
    assert not Path("out", "model.pt").exists()


def test_a_foreign_mcap_is_refused_with_its_topics(made, refused, tmp_path):
    with (tmp_path / "camera.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/camera", "json", writer.register_schema("Image", "jsonschema", b"{}"))
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()
    for words in (fit_f(tmp_path / "camera.mcap"), fit_g(made, tmp_path / "camera.mcap")):
        assert "is an MCAP file, but not an episode log of twbal" in (said := refused(*words))
        assert "/camera" in said


class Trap:
    """Makes a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return self.path.touch, ()


@pytest.mark.parametrize(
    "words",
    [
        ["optimise-policy", "dynamics=trap.pt"],
        ["fit-diff-gp", "dynamics=trap.pt", "episodes=LOG"],
        ["real-rollout", "policy.path=trap.pt"],
        ["sim-collect", "policy=saved", "policy.path=trap.pt"],
    ],
)
def test_a_checkpoint_that_needs_code_to_load_is_refused_and_not_run(words, log, refused, tmp_path):
    payload = {"x": Trap(tmp_path / "sprung")}
    torch.save({"format": "twbal checkpoint", "schema_version": 1, "kind": "model", "payload": payload}, "trap.pt")
    said = refused(*(word.replace("LOG", str(log)) for word in words))
    assert "trap.pt needs code to load" in said
    assert not (tmp_path / "sprung").exists()


def test_a_logged_sample_that_is_no_number_is_named(log, refused, tmp_path):
    spoilt = read_episode(log)
    states = spoilt.states.copy()
    states[3, 1] = np.nan
    object.__setattr__(spoilt, "states", states)  # an episode refuses it at birth; other programs may not
    write_episode(tmp_path / "spoilt.mcap", spoilt)
    said = refused(*fit_f(tmp_path / "spoilt.mcap"))
    assert "spoilt.mcap" in said
    assert "Sample 3 of the episode's states is not a finite number" in said


def test_an_episode_with_other_state_channels_than_the_models_is_refused_with_both(made, refused, tmp_path):
    words = ["sim-collect", "state=paper", "rollouts=1", "steps=12", f"hydra.run.dir={tmp_path / 'paper'}"]
    assert main(words) == 0
    said = refused(*fit_g(made, tmp_path / "paper"))
    assert "tilt, tilt_rate, acceleration" in said
    assert "tilt, tilt_rate, speed, command_1, command_2" in said


def test_an_episode_of_another_robot_is_refused_with_both_names(log, refused):
    said = refused(*fit_f(log), "robot=regbot")
    assert "is an episode of the robot 'paper'; expected is 'regbot'" in said
    said = refused("identify", f"episodes={log}", "robot=regbot")
    assert "is an episode of the robot 'paper'; expected is 'regbot'" in said


def test_too_few_samples_are_refused_with_how_many_there_are(made, refused, tmp_path):
    assert main(["sim-collect", "rollouts=1", "steps=1", f"hydra.run.dir={tmp_path / 'one'}"]) == 0
    assert "Too few samples" in refused(*fit_f(tmp_path / "one"))
    assert "Too few samples" in refused(*fit_g(made, tmp_path / "one"))


def test_a_folder_where_a_file_belongs_is_named(made, refused):
    assert f"{made / 'f'} is a folder; expected is a file" in refused("optimise-policy", f"dynamics={made / 'f'}")


@pytest.mark.parametrize("place", ["file", "file/below"])
def test_a_run_folder_that_cannot_be_one_is_named(place, refused, tmp_path):
    (tmp_path / "file").write_text("kept")
    said = refused("sim-collect", f"hydra.run.dir={tmp_path / place}", "rollouts=1", "steps=2")
    assert f"Cannot use {tmp_path / place}: " in said
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["sim-collect", "--cfg", "job"]])
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_output_to_a_full_device_is_one_clear_line(words, unbuffered, tmp_path):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "PYTHONUNBUFFERED": unbuffered}
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "twbal", *words]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path, env=environment)
    (said,) = done.stderr.splitlines()
    assert said.startswith("twbal: error: Cannot write the output: No space left on device.")
    assert done.returncode == 1


def test_a_pipe_for_a_policy_is_refused_and_not_waited_for(refused, tmp_path):
    os.mkfifo(tmp_path / "policy.pt")
    said = refused("sim-collect", "policy=saved", f"policy.path={tmp_path / 'policy.pt'}", "rollouts=1")
    assert "it is a pipe or a device, and no file" in said


# Robots that cannot be driven


class Killer(Policy):
    """Commands nothing; its eighth command comes from the grave."""

    def __init__(self, pid: int) -> None:
        self.pid = pid

    def controller(self, rng):
        steps = iter(range(1000))

        def law(state):
            if next(steps) == 7:
                os.kill(self.pid, signal.SIGKILL)
            return 0.0

        return law


def drive(port: str, *words: str) -> list[str]:
    patience = ("link.connect_timeout=10", "link.arm_timeout=10", "link.timeout=10")
    link = ("link=serial", f"link.port={port}", "link.confirm_placed=null", *patience)
    return ["real-rollout", "hydra.run.dir=out", *link, *words]


@pytest.mark.parametrize("clock", ["lockstep", "real_time"])
def test_a_robot_killed_in_mid_rollout_leaves_the_episode_so_far_marked_link_lost(clock, refused, tmp_path):
    with closing(
        VirtualRobotProcess.ready(virtual_robot_command([f"clock={clock}", "self_stop_tilt=100"]), 60.0)
    ) as robot:
        (tmp_path / "conf" / "policy").mkdir(parents=True)
        policy = f"_target_: {Killer.__module__}.Killer\npid: {robot.pid}\n"
        (tmp_path / "conf" / "policy" / "killer.yaml").write_text(policy)
        said = refused(*drive(robot.port, "policy=killer", "tilt_limit=1.5"), f"--config-dir={tmp_path / 'conf'}")
    (kept,) = Path("out").rglob("*.mcap")
    assert f"7 samples of trial 0 are kept in {kept}, marked link lost" in said
    episode = read_episode(kept)
    assert (episode.outcome, len(episode)) == (Outcome.LINK_LOST, 7)
    assert robot.port in episode.events[-1].text


def robot_behind_a_port(sim_plant, change: Callable[[Message], Message]):
    """The path of the port of a robot in this process; `change` is what the line does to what it says."""
    identity = Identity("paper", torque_limit=20.0, tilt_limit=1.0, watchdog=0.1, clock=Clock.LOCKSTEP)

    def on_the_line(said: bytes) -> bytes:
        return b"".join(to_wire(change(message)) for message in Decoder().feed(said))

    return served(Firmware(sim_plant, identity), on_the_line)


@pytest.fixture
def sim_plant(paper):
    from twbal.core.start_pose import StartPose
    from twbal.sim.bullet_plant import SimPlant

    start = StartPose(-0.17, 0.0, 0.0, 0.0)
    with SimPlant(robot=paper, effects=[], start=start, physics_step=1e-3, seed=0) as plant:
        yield plant


def test_a_robot_of_another_protocol_version_is_refused_with_both_versions(sim_plant, refused):
    def from_the_future(said):
        return Welcome(said.seq, 7) if isinstance(said, Welcome) else said

    with robot_behind_a_port(sim_plant, from_the_future) as port:
        said = refused(*drive(port, "policy=random"))
    assert f"{port} speaks version 7 of the link protocol, this twbal versions 1 and 2. Update the older" in said
    assert not list(Path("out").rglob("*.mcap"))


def test_a_robot_whose_sensor_breaks_in_mid_rollout_leaves_the_episode_so_far(sim_plant, refused):
    def broken(said):
        return replace(said, tilt_rate=math.nan) if isinstance(said, Telemetry) and said.period > 5 else said

    with robot_behind_a_port(sim_plant, broken) as port:
        said = refused(*drive(port, "policy=random"))
    assert "not finite numbers (tilt_rate)" in said
    (kept,) = Path("out").rglob("*.mcap")
    assert f"5 samples of trial 0 are kept in {kept}" in said
    assert len(read_episode(kept)) == 5


@pytest.mark.parametrize("period", [2, 100])
def test_a_robot_that_does_not_say_that_it_is_off_leaves_the_episode_and_a_warning(period, sim_plant, refused):
    def unstoppable(said):
        if not isinstance(said, Telemetry):
            return said
        return replace(said, status=Status.ARMED, tilt=3e38 if said.period >= period else said.tilt)

    with robot_behind_a_port(sim_plant, unstoppable) as port:
        said = refused(*drive(port, "policy=random", "steps=4", "link.timeout=1"))
    assert "does not confirm that its motors are off, and THEY MAY STILL BE ON" in said
    (kept,) = Path("out").rglob("*.mcap")
    episode = read_episode(kept)
    assert (len(episode), episode.outcome) == (min(period - 1, 4), Outcome.LINK_LOST)
    assert "THEY MAY STILL BE ON" in " ".join(event.text for event in episode.events)
    assert ("beyond what any robot does (tilt 3e+38 rad" in said) == (period < 4)


def test_a_port_that_is_not_there_is_noticed_before_anything_is_simulated(refused):
    said = refused("iterate", "hydra.run.dir=out", "link=serial", "link.port=/dev/no_such_port")
    assert "Cannot open the port /dev/no_such_port" in said
    assert "Is the robot plugged in" in said
    assert not Path("out", "simulation").exists()


def test_a_robot_that_is_not_the_data_sheets_is_noticed_before_anything_is_simulated(sim_plant, refused):
    with robot_behind_a_port(sim_plant, lambda said: said) as port:
        link = ("link=serial", f"link.port={port}", "link.connect_timeout=10")
        said = refused("iterate", "hydra.run.dir=out", "robot=regbot", *link)
    assert "has a control period of 0.02 s; the data sheet 'regbot' says 0.015 s" in said
    assert not Path("out", "simulation").exists()


def test_a_policy_made_for_a_stronger_robot_is_refused_before_the_robot_is_reached(refused, tmp_path):
    from twbal.io.checkpoint import save_checkpoint
    from twbal.policies.rbf import RbfPolicy

    channels = ("tilt", "tilt_rate", "speed", "command_1", "command_2")
    policy = RbfPolicy(channels, np.zeros((1, 5)), np.zeros(1), np.ones(5), np.zeros(5), max_command=20.0)
    save_checkpoint(tmp_path / "policy.pt", "policy", policy.to_payload())
    said = refused(*drive("nowhere", "robot=regbot", "state=rolling", "policy.path=policy.pt"))
    assert "commands up to 20 N·m; the robot 'regbot' takes 0.49 N·m" in said


# Nothing is lost


def test_a_refusal_leaves_a_finished_run_folder_as_it_was(made, refused):
    before = content(made)
    assert "which is kept" in refused("sim-collect", f"hydra.run.dir={made / 'sim'}", "rollouts=5", "steps=12")
    assert "which is kept" in refused("fit-sim-gp", f"hydra.run.dir={made / 'f'}", f"episodes={made / 'sim'}", "seed=3")
    after = content(made)
    kept = {path: sha for path, sha in before.items() if ".hydra" not in path.parts and path.suffix != ".log"}
    assert {path: after[path] for path in kept} == kept


def test_a_robot_weaker_than_its_data_sheet_is_refused_with_both_limits(sim_plant, refused):
    def weaker(said):
        return replace(said, torque_limit=12.0) if isinstance(said, Welcome) else said

    with robot_behind_a_port(sim_plant, weaker) as port:
        said = refused(*drive(port, "policy=random"))
    assert "takes at most 12 N·m; the data sheet 'paper' says 20 N·m" in said
    assert not list(Path("out").rglob("*.mcap"))
