"""`twbal drive`, from keys on a terminal or events of a gamepad to its files, on the virtual robot."""

import os
import pty
import re
import signal
import subprocess
import sys
import termios
import threading
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hydra import compose

from twbal.algorithm.rollout import rollout
from twbal.cli.composition import composing
from twbal.cli.main import main
from twbal.cli.stages import drive as stage
from twbal.core.channels import Channels
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import LinkLostError
from twbal.core.robot_parameters import RobotParameters
from twbal.io.checkpoint import save_checkpoint
from twbal.io.logs import read_episode
from twbal.link.serial_plant import SerialPlant
from twbal.policies.linear import LinearPolicy
from twbal.steering.joystick import EVENT
from twbal.steering.limits import SteeringLimits
from twbal.virtual_robot.process import KeptRobots

CHANNELS = ("tilt", "tilt_rate", "speed", "command_1", "command_2", "position", "position_integral")
GAIN = [-71.6, -11.7, -11.2, 0.0, 0.0, -14.5, -4.0]  # of a linear-quadratic regulator of the sheet, with a place
SPEED_LIMIT = 1.0
LONGEST = 60.0  # s of the robot's time, after which a drive ends whatever the person does


@pytest.fixture(scope="module")
def robot():
    with KeptRobots() as kept:
        yield kept


@pytest.fixture(scope="module")
def policy(tmp_path_factory):
    path = tmp_path_factory.mktemp("policy") / "policy.pt"
    save_checkpoint(path, "policy", LinearPolicy(CHANNELS, np.array(GAIN), 0.0, 20.0).to_payload())
    return path


def drive(robot, policy, out, *words):
    """The stage, on a virtual robot that is started once; its time goes five times as fast as ours."""
    told = [
        f"policy.path={policy}",
        "pace=5",
        "link.start_timeout=600",  # s; on a busy machine
        "steering.hold=true",
        f"seconds={LONGEST}",
        f"steering.speed_limit={SPEED_LIMIT}",
    ]
    with composing():
        cfg = compose("drive", [*told, *words, 'link.overrides=["faults=none","idle_timeout=300"]'])
        stage.run(cfg, out, robot.launch)


class Person(threading.Thread):
    """At the other end of a pseudo-terminal: does each act once what is shown has matched its pattern."""

    def __init__(self, *acts):
        super().__init__(daemon=True)
        self._end, self.program = pty.openpty()
        self.shown, self._acts = "", list(acts)  # lately

    def run(self):
        with suppress(OSError):  # the terminal is closed
            while data := os.read(self._end, 4096):
                self.shown = (self.shown + data.decode())[-400:]
                if self._acts and re.search(self._acts[0][0], self.shown):
                    _, act = self._acts.pop(0)
                    self.shown = ""
                    act() if callable(act) else os.write(self._end, act)

    def leave(self):
        os.close(self._end)


@pytest.fixture
def at_terminal(monkeypatch):
    """Puts a person at the terminal of this process."""
    ends = []

    def sit(*acts):
        person = Person(*acts)
        streams = [os.fdopen(os.dup(person.program), mode) for mode in ("r", "w")]
        ends.extend([*streams, os.fdopen(person.program)])
        monkeypatch.setattr("sys.stdin", streams[0])
        monkeypatch.setattr("sys.stdout", streams[1])
        person.before = termios.tcgetattr(person.program)
        person.start()
        return person

    yield sit
    monkeypatch.undo()
    for end in ends:
        end.close()


def test_keys_steer_over_a_terminal_and_the_drive_is_an_episode(robot, policy, at_terminal, tmp_path):
    person = at_terminal(("tilt", b"w\x1b[Aw"), (r"reference \+0\.30 ", b"a"), (r"heading +\+([3-9]|\d\d)", b" q"))
    drive(robot, policy, tmp_path)
    assert termios.tcgetattr(person.program) == person.before
    episode = read_episode(tmp_path / "episodes" / "trial_000.mcap")
    assert episode.outcome is Outcome.COMPLETED
    assert episode.references[:, 1].max() == pytest.approx(0.3 * SPEED_LIMIT)
    assert episode.references[-1, 1:] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert episode.headings[-1, 2] == pytest.approx(episode.headings[-1, 0], abs=np.radians(3.0))
    assert episode.headings[-1, 0] > np.radians(2.0)
    texts = [event.text for event in episode.events]
    assert (
        "ended by a key: the reference goes to rest" in texts
        and "ended by a key, and the reference came to rest" in texts
    )
    assert "heading" in (tmp_path / "figures" / "trial_000.svg").read_text()


def test_the_stop_key_switches_off_and_the_drive_is_kept(robot, policy, at_terminal, tmp_path):
    at_terminal(("tilt", b"w"), (r"asked \+0\.10", b"x"))
    drive(robot, policy, tmp_path)
    episode = read_episode(tmp_path / "episodes" / "trial_000.mcap")
    assert episode.outcome is Outcome.STOPPED and episode.events[-1].text == "stopped by a key"


def test_motors_that_may_be_on_after_the_stop_key_are_an_error(robot, policy, at_terminal, tmp_path, monkeypatch):
    stop = SerialPlant.stop

    def unconfirmed(plant):
        stop(plant)
        raise LinkLostError("The robot does not confirm that its motors are off.")

    monkeypatch.setattr(SerialPlant, "stop", unconfirmed)
    at_terminal(("tilt", b"w"), (r"asked \+0\.10", b"x"))
    with pytest.raises(LinkLostError, match=r"does not confirm that its motors are off\. .* are kept in .*lost_0"):
        drive(robot, policy, tmp_path)
    assert not (tmp_path / "episodes").exists()


@pytest.mark.parametrize(("asked", "yields"), [("true", True), ("null", False)])
def test_a_robot_yields_to_pushes_on_its_way_where_that_is_asked_for(
    asked, yields, robot, policy, at_terminal, tmp_path, monkeypatch
):
    given = []

    def watched(*asked, **more):
        given.append(more["yields"])
        return rollout(*asked, **more)

    monkeypatch.setattr(stage, "rollout", watched)
    at_terminal(("tilt", b"q"))
    drive(robot, policy, tmp_path, f"yield_to_pushes={asked}")
    assert given == [yields]


def test_a_terminal_that_is_closed_ends_the_drive_at_rest_with_its_episode(robot, policy, at_terminal, tmp_path):
    person = at_terminal(("tilt", b"w"), (r"asked \+0\.10", lambda: person.leave()))
    drive(robot, policy, tmp_path)
    episode = read_episode(tmp_path / "episodes" / "trial_000.mcap")
    assert episode.outcome is Outcome.COMPLETED
    assert episode.references[-1, 1:] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert "the terminal was lost, and the reference came to rest" in [event.text for event in episode.events]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_it_as_a_rollout_and_the_terminal_is_as_before(robot, policy, at_terminal, tmp_path, number):
    person = at_terminal(("tilt", lambda: os.kill(os.getpid(), number)))
    with pytest.raises(KeyboardInterrupt):
        drive(robot, policy, tmp_path)
    assert termios.tcgetattr(person.program) == person.before
    episode = read_episode(tmp_path / "interrupted" / "trial_000_stopped_0.mcap")
    assert episode.outcome is Outcome.STOPPED and episode.references is not None


def test_a_hang_up_signal_ends_the_drive_at_rest(robot, policy, at_terminal, tmp_path):
    at_terminal(("tilt", lambda: os.kill(os.getpid(), signal.SIGHUP)))
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # who is started by `nohup` ignores it
    try:
        drive(robot, policy, tmp_path)
    finally:
        signal.signal(signal.SIGHUP, before)
    episode = read_episode(tmp_path / "episodes" / "trial_000.mcap")
    assert episode.outcome is Outcome.COMPLETED
    assert episode.observations[-1, 0] < 0.5 * LONGEST
    assert "the terminal was lost, and the reference came to rest" in [event.text for event in episode.events]


def test_with_a_gamepad_ctrl_z_does_nothing_and_a_hang_up_ends_the_drive_at_rest(
    robot, policy, at_terminal, tmp_path, monkeypatch
):
    modes = []

    def disturb():
        modes.append(termios.tcgetattr(person.program))
        os.kill(os.getpid(), signal.SIGTSTP)
        os.kill(os.getpid(), signal.SIGHUP)

    person = at_terminal(("tilt", disturb))
    os.mkfifo(tmp_path / "js0")
    pad = os.open(tmp_path / "js0", os.O_RDWR | os.O_NONBLOCK)
    suspended = []
    before = signal.signal(signal.SIGTSTP, lambda number, frame: suspended.append(number))
    hung_up = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # who is started by `nohup` ignores it
    try:
        drive(robot, policy, tmp_path, f"input={tmp_path / 'js0'}")
    finally:
        signal.signal(signal.SIGTSTP, before)
        signal.signal(signal.SIGHUP, hung_up)
        os.close(pad)
    assert not suspended
    assert modes[0][6][termios.VSUSP] == b"\0" and not modes[0][0] & termios.IXON
    assert termios.tcgetattr(person.program) == person.before
    episode = read_episode(tmp_path / "episodes" / "trial_000.mcap")
    assert episode.outcome is Outcome.COMPLETED
    assert episode.observations[-1, 0] < 0.5 * LONGEST
    assert "the terminal was lost, and the reference came to rest" in [event.text for event in episode.events]


def test_recorded_events_of_a_gamepad_drive_the_same_way_each_time(robot, policy, tmp_path):
    forward, left, middle, start = (-16384, 2, 1), (-32767, 2, 0), (0, 2, 1), (1, 1, 7)
    events = [(0, 0, 2, 5), (1000, *forward), (2500, *left), (3200, 0, 2, 0), (3500, *middle), (4500, *start)]
    (tmp_path / "pad.bin").write_bytes(b"".join(EVENT.pack(*event) for event in events))
    for name in "ab":
        drive(robot, policy, tmp_path / name, f"input={tmp_path / 'pad.bin'}", "pace=100")
    first, second = (read_episode(tmp_path / name / "episodes" / "trial_000.mcap") for name in "ab")
    np.testing.assert_array_equal(first.references, second.references)
    np.testing.assert_array_equal(first.commands, second.commands)
    assert first.references[:, 1].max() == pytest.approx((0.5 - 0.1) / 0.9 * SPEED_LIMIT, abs=1e-4)
    assert not first.references[first.observations[:, 0] <= 1.0].any()
    assert first.headings[-1, 0] > 0.1 and first.outcome is Outcome.COMPLETED


def test_a_gamepad_that_falls_silent_with_its_stick_forward_does_not_drive_the_robot_on(robot, policy, tmp_path):
    events = [(0, 0, 2, 5), (1000, -32767, 2, 1), (12_000, 1, 1, 7)]
    (tmp_path / "pad.bin").write_bytes(b"".join(EVENT.pack(*event) for event in events))
    drive(robot, policy, tmp_path / "out", f"input={tmp_path / 'pad.bin'}", "pace=100")
    episode = read_episode(tmp_path / "out" / "episodes" / "trial_000.mcap")
    times = episode.observations[:, 0]
    assert episode.references[:, 1].max() > 0.3
    assert times[-1] >= 12.0
    assert episode.references[times > 8.0, 1] == pytest.approx(0.0, abs=1e-9)
    (silent,) = [event for event in episode.events if event.text.startswith("no event of the gamepad for 2 s")]
    assert 3.0 < silent.time < 3.05


def test_a_drive_that_is_there_already_is_told_to_be(policy, tmp_path, capsys):
    (tmp_path / "pad.bin").write_bytes(EVENT.pack(0, 1, 1, 0) + EVENT.pack(400, 1, 1, 0))
    words = [f"policy.path={policy}", 'link.overrides=["faults=none"]', f"input={tmp_path / 'pad.bin'}", "pace=100"]
    said = []
    for _ in range(2):
        assert main(["drive", *words, "seconds=1", f"hydra.run.dir={tmp_path / 'out'}"]) == 0
        said.append(re.findall(r" samples.*", capsys.readouterr().out))
    assert said == [
        [" samples"],
        [" samples, driven before; without hydra.run.dir, or with another one, it drives again"],
    ]


def test_a_drive_that_ended_before_its_figure_was_drawn_is_not_driven_again(policy, tmp_path, capsys, monkeypatch):
    (tmp_path / "pad.bin").write_bytes(EVENT.pack(0, 1, 1, 0) + EVENT.pack(400, 1, 1, 0))
    words = [f"policy.path={policy}", 'link.overrides=["faults=none"]', f"input={tmp_path / 'pad.bin'}", "pace=100"]
    words = ["drive", *words, "seconds=1", f"hydra.run.dir={tmp_path / 'out'}"]

    def interrupted(figure, file):
        raise KeyboardInterrupt

    with monkeypatch.context() as broken:
        broken.setattr("twbal.cli.stages.drive.save", interrupted)
        assert main(words) != 0
    log = tmp_path / "out" / "episodes" / "trial_000.mcap"
    before = (log.stat().st_mtime_ns, log.read_bytes())
    capsys.readouterr()
    assert main(words) == 0
    assert "driven before" in capsys.readouterr().out
    assert (log.stat().st_mtime_ns, log.read_bytes()) == before
    assert (tmp_path / "out" / "figures" / "trial_000.svg").is_file()


def test_a_drive_is_recorded_as_a_live_view_shows_it(robot, policy, at_terminal, tmp_path):
    pytest.importorskip("rerun", reason="comes with the extra [viewers]")
    person = at_terminal(("tilt", b"www"), (r"reference \+0\.30 ", b"q"))
    drive(robot, policy, tmp_path, "view=file")
    episode = read_episode(tmp_path / "episodes" / "trial_000.mcap")
    assert "the live view lacks" not in person.shown and "failed" not in person.shown
    program = Path(sys.executable).with_name("rerun")
    shown = {}
    for entity in ("plots/speed/reference", "plots/speed/asked", "plots/command/command"):
        command = [program, "rrd", "print", "-vvv", "--entity", f"/{entity}", tmp_path / "view" / "trial_000.rrd"]
        text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        shown[entity] = np.array(re.findall(r"┆ PT?[\d.]+[SD] +┆ \[([-\d.e]+)\]", text), dtype=float)
    assert shown["plots/speed/reference"] == pytest.approx(episode.references[:, 1], abs=1e-9)
    assert shown["plots/command/command"] == pytest.approx(np.append(0.0, episode.commands), abs=1e-9)
    assert shown["plots/speed/asked"].max() == pytest.approx(0.3 * SPEED_LIMIT)


def test_a_live_view_that_is_not_installed_is_one_error_and_no_robot(policy, tmp_path, capfd, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    words = [f"policy.path={policy}", "view=file", "link=serial", "link.port=/dev/null"]
    assert main(["drive", *words, f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    said = capfd.readouterr().err
    assert said.count("twbal: error:") == 1 and "pip install -e '.[viewers]'" in said


@pytest.mark.parametrize(
    ("wheel_rate", "expected"),
    [(0.9, []), (-5.0, ["the robot itself still drives at -0.40 m/s: the policy does not hold it"])],
)
def test_a_robot_that_drives_on_when_its_reference_rests_is_said_to(wheel_rate, expected):
    sheet = RobotParameters("cart", 5.0, 0.25, 0.0, 0.1, 0.1, 0.05, 0.5, 0.1, 0.003, 0.03, 0.4, 10.0, 0.02)
    limits = SteeringLimits.from_settings(sheet, 0.1, 0.5, 0.5, False, 2.0, speed_limit=1.0)
    policy = LinearPolicy(CHANNELS, np.array(GAIN), 0.0, 10.0)
    driven = stage.Steered(sheet, policy, Channels(("speed",), 0.1), limits)
    seen = np.array([[0.0] * 7, [0.02, 0.1, 1.0, 0.0, 0.0, wheel_rate, 0.0]])
    ends = Outcome.COMPLETED, Provenance("cart", "robot")
    episode = Episode(("speed",), 0.02, seen, np.zeros((2, 1)), np.zeros(1), *ends)
    assert [event.text for event in stage._drives_on(episode, driven)] == expected


def test_without_a_terminal_there_is_one_error_and_no_robot(policy, tmp_path, capfd, monkeypatch):
    with open(os.devnull) as nothing:
        monkeypatch.setattr("sys.stdin", nothing)
        words = [f"policy.path={policy}", "link=serial", "link.port=/dev/null", f"hydra.run.dir={tmp_path / 'out'}"]
        assert main(["drive", *words]) == 1
    said = capfd.readouterr().err
    assert said.count("twbal: error:") == 1 and "standard input is no terminal" in said


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("state=rolling", "Choose the state that it was made with"),
        ("input=/dev/input/js99", "Cannot open the gamepad /dev/input/js99"),
        ("steering.speed_step=2", "a number from 0.01 to 1"),
        ("experiment=drive", "experiment"),
    ],
)
def test_what_cannot_be_driven_is_refused(policy, tmp_path, capsys, word, message):
    assert main(["drive", f"policy.path={policy}", word, f"hydra.run.dir={tmp_path / 'out'}"]) != 0
    assert message in capsys.readouterr().err
