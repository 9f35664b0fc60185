"""One trial: a rollout of the real host over a line with one kind of fault to one robot."""

import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from random import Random
from subprocess import DEVNULL, Popen

from benchmarks.link_faults.disturbances import Way, as_it_came, lost
from benchmarks.link_faults.host import Host, get_ready
from benchmarks.link_faults.kinds import NONE, Kind
from benchmarks.link_faults.line import Line, Passed
from benchmarks.link_faults.stage import Stage
from twbal.cli.main import main

POLICY = Path(__file__).resolve().parents[2] / "data" / "regression" / "policy.pt"
STEPS = 75  # of a rollout
AWAY = 0.3  # for which a port that vanishes is away [s]
SETTLED = {"lockstep": 0.02, "real_time": 0.15}  # after which the robot has stopped by itself [s]
_START, _LONGEST = 240.0, 60.0  # of the robot, of a rollout [s]
_ROBOT = ("faults=light", "seed=4")


@dataclass(frozen=True)
class Happened:
    """What a trial came to, before it is judged.

    Attributes:
        kind: of fault.
        passed: what the line saw.
        torques: what the motors got in each control period since the robot was put at its start [N·m].
        code: exit code of the command.
        complaints: lines of its standard error.
        folder: its run folder.
        again: exit code of the same command, once more; None where it was not given again.
        said_again: what that printed, and complained of.
        passed_again: what the line saw of it.
    """

    kind: Kind
    passed: Passed
    torques: Sequence[float]
    code: int
    complaints: Sequence[str]
    folder: Path
    again: int | None = None
    said_again: str = ""
    passed_again: Passed = field(default_factory=Passed)


class Faults:
    """The faults of a trial, which begin when the robot has come to a control period.

    Args:
        kind: of fault.
        rng: of the trial.
        line: that has them.
        host: that is killed, where one is.
        robot: process that is the robot's board.
    """

    def __init__(self, kind: Kind, rng: Random, line: Line, host: Host, robot: int) -> None:
        self._kind, self._line, self._host, self._robot = kind, line, host, robot
        self._to_robot, self._to_host = kind.to_robot(rng), kind.to_host(rng)
        self._began: float | None = None
        self._over = False

    def to_robot(self, data: bytes) -> bytes:
        """What reaches the robot."""
        return self._now(self._to_robot)(data)

    def to_host(self, data: bytes) -> bytes:
        """What reaches the host."""
        if self._kind.act == "deaf" and self._line.passed.stops:
            return lost(data)
        return self._now(self._to_host)(data)

    def act(self) -> None:
        """Begin and end what is not a matter of bytes."""
        now, sent = time.monotonic(), self._line.passed.sent
        if self._began is None and sent and self._line.passed.rollouts == self._kind.rollouts:
            if sent[-1][1].is_armed and sent[-1][1].period >= self._kind.begins > 0:
                self._began = now
                self._begin()
        elif self._kind.act == "vanish" and self._began is not None and now > self._began + AWAY:
            self._line.come_back()

    def _now(self, way: Way) -> Way:
        if not self._kind.begins:
            return way
        begun = self._began is not None and time.monotonic() < self._began + self._kind.seconds
        return way if begun else as_it_came

    def _begin(self) -> None:
        match self._kind.act:
            case "vanish":
                self._line.vanish()
            case "kill":
                self._host.kill()
            case "reset":
                os.kill(self._robot, signal.SIGUSR1)


class Workplace:
    """A robot, the line to it and a folder, for one trial after another.

    In lockstep the host is the stage alone, as what it does before it drives needs no time on the robot's clock; in
    real time it is the whole command.

    Args:
        clock: "lockstep" or "real_time".
        program: the firmware's; None: the virtual robot in Python.
    """

    def __init__(self, clock: str, program: Path | None) -> None:
        self._ends = ExitStack()
        with self._ends:  # on an error
            self._folder = Path(self._ends.enter_context(tempfile.TemporaryDirectory(prefix="twbal-faults-")))
            words = ["-" if program is None else str(program), f"clock={clock}", *_ROBOT]
            (self._folder / "sensors").write_text("")
            self._robot = Popen(
                [sys.executable, "-m", "benchmarks.link_faults.robot", str(self._folder), *words], stdout=DEVNULL
            )
            self._ends.callback(self._robot.wait)
            self._ends.callback(self._robot.terminate)
            get_ready(self._words(NONE, 0, self._folder))  # there is no line yet
            deadline = time.monotonic() + _START
            while not (self._folder / "port").exists():
                if self._robot.poll() is not None or time.monotonic() > deadline:
                    raise SystemExit("The robot does not start.")
                time.sleep(0.05)
            self._settled = SETTLED[clock]
            self._command = Stage().prepared if clock == "lockstep" else _whole
            self._line = Line(self._folder / "line", self._folder / "port")
            self._ends.callback(self._line.close)
            self._ends = self._ends.pop_all()

    def close(self) -> None:
        """End the robot, and remove its files."""
        self._ends.close()

    @contextmanager
    def happened(self, kind: Kind, trial: int) -> Iterator[Happened]:
        """Drive a trial; its files last as long as the body."""
        folder = Path(tempfile.mkdtemp(dir=self._folder))
        try:
            yield self._happened(kind, trial, folder)
        finally:
            shutil.rmtree(folder)

    def _happened(self, kind: Kind, trial: int, folder: Path) -> Happened:
        sensors = f"{kind.sensors} {kind.begins}" if kind.sensors else ""
        (self._folder / "sensors").write_text(sensors)
        host, passed = self._drive(kind, trial, folder, self._words(kind, trial, folder))
        torques = [float(line) for line in (self._folder / "steps").read_text().split()]
        done = Happened(kind, passed, torques, host.code, host.complaints, folder / "run")
        if not kind.again:
            return done
        (self._folder / "sensors").write_text("")
        host, passed = self._drive(NONE, trial, folder, self._words(kind, trial, folder))
        return replace(done, again=host.code, said_again=host.words + " ".join(host.complaints), passed_again=passed)

    def _words(self, kind: Kind, trial: int, folder: Path) -> list[str]:
        return [
            *("real-rollout", f"policy.path={POLICY}", "state=rolling", f"steps={STEPS}", f"first_trial={trial}"),
            *(f"trials={kind.rollouts}", "link=serial", f"link.port={self._folder / 'line'}"),
            *("link.confirm_placed=null", "heed_check=false", f"hydra.run.dir={folder / 'run'}"),
        ]

    def _drive(self, kind: Kind, trial: int, folder: Path, words: Sequence[str]) -> tuple[Host, Passed]:
        self._line.begin_record()
        passed = self._line.passed
        host = Host(self._command(words), folder)
        faults = Faults(kind, Random(f"{kind.name} {trial}"), self._line, host, self._robot.pid)
        while not host.has_ended:
            self._line.pump(0.02, faults)
            faults.act()
            if host.seconds > _LONGEST:
                host.kill()
        until = time.monotonic() + self._settled
        while time.monotonic() < until:
            self._line.pump(0.02, faults)
            faults.act()
        self._line.come_back()
        return host, passed


def _whole(words: Sequence[str]) -> Callable[[], int]:
    return partial(main, words)
