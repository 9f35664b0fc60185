"""The robot that is driven: the firmware's program over MuJoCo's physics, in real time, with real-time priority.

The robot stands for one that has a processor of its own. So its two processes go before all others, and what is late is
the host alone. Its policy is the linear-quadratic regulator of its sheet, of its own control period, here and on board;
it hides nothing, so that it falls by lateness alone.
"""

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

from twbal.virtual_robot.process import VirtualRobotProcess, virtual_robot_command

ROOT = Path(__file__).resolve().parents[2]
MADE = Path("outputs/bench/latency")
PRIORITY = 60
"""Of the robot's processes; the host's loop has 50."""

_PHYSICS_STEP = 0.001
"""Four times the default [s]: the physics runs beside the host, on the same two cores; a real robot needs none."""

_START = 300.0  # a robot may take so long to start beside other work [s]


def environment() -> dict[str, str]:
    """Of programs that find the benchmarks, which are not installed."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    return {**os.environ, "PYTHONPATH": path}


def twbal(*words: str) -> list[str]:
    """A command of twbal."""
    return [sys.executable, "-m", "twbal", *words]


def period_of(rate: int) -> str:
    """The setting of the control period of a rate [Hz]."""
    return f"robot.control_period={1.0 / rate!r}"


def policy(rate: int) -> Path:
    """A policy for a rate [Hz], made where it is not there."""
    made = MADE / f"policy_{rate}" / "policy.pt"
    if not made.exists():
        _run(twbal("lqr", period_of(rate), f"hydra.run.dir={made.parent}"))
    return made


def firmware(rate: int) -> Path:
    """The program with that policy on board."""
    header, build = MADE / f"header_{rate}", MADE / f"firmware_{rate}"
    if not (header / "policy.h").exists():
        _run(twbal("export-policy", f"policy.path={policy(rate)}", period_of(rate), f"hydra.run.dir={header}"))
    _run(["make", "-s", "-C", str(ROOT / "firmware"), f"POLICY={header.resolve()}", f"BUILD={build.resolve()}"])
    return build / "robot_posix"


@contextmanager
def robot(rate: int) -> Iterator[str]:
    """The robot; yields its port."""
    settings = [period_of(rate), f"firmware={firmware(rate)}", "faults=none", "clock=real_time", "idle_timeout=60"]
    settings.append(f"physics_step={_PHYSICS_STEP}")
    command = ["chrt", "--fifo", str(PRIORITY), *virtual_robot_command(settings)]
    with closing(VirtualRobotProcess.ready(command, _START)) as process:
        yield process.wait_for_port(_START)


def without_priority() -> list[str]:
    """What stands before a command so that it cannot get real-time priority."""
    if os.geteuid() == 0:
        return ["setpriv", "--bounding-set=-sys_nice", "--inh-caps=-sys_nice"]
    return ["prlimit", "--rtprio=0"]


def _run(command: Sequence[str]) -> None:
    done = subprocess.run(command, cwd=ROOT, env=environment(), capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
