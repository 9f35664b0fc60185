"""The robots that the suite tries: those of this repository, or the one that `--robot` gives."""

import shlex
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from building import program
from talking import MemoryHost, PortHost

from twbal.virtual_robot.process import VirtualRobotProcess, virtual_robot_command

_PENDULUM = Path(__file__).parent / "robots" / "pendulum.pl"
PERL_ROBOT = f"perl '{_PENDULUM}' clock={{clock}}"
_START = 240.0  # a first start compiles, which takes a minute on a busy machine [s]


def _runs_perl():
    """Whether there is a Perl with all its core modules, and pseudo-terminals as the robot opens them."""
    perl = shutil.which("perl")
    if perl is None or sys.platform != "linux":
        return False
    return subprocess.run([perl, "-c", _PENDULUM], capture_output=True).returncode == 0


needs_perl = pytest.mark.skipif(not _runs_perl(), reason="the robot in Perl needs Linux and perl with its modules")


@contextmanager
def robot_of(kind, clock, standing=None):
    """Opens hosts of a robot that lives as long as the body.

    Args:
        kind: "memory", "mujoco" or "firmware"; or a command that prints `port <path>`, with {clock} for the clock.
        clock: of the robot, where it has a choice.
        standing: host on the port that is given; None: there is none.
    """
    if kind == "memory":
        yield lambda: MemoryHost(clock)
    elif standing:
        yield lambda: standing
    else:
        process = VirtualRobotProcess.ready(_command(kind, clock.name.lower()), _START)
        try:
            yield lambda: PortHost(process.port, kind in ("mujoco", "firmware", PERL_ROBOT))
        finally:
            process.close()


def checked(robot):
    """What `--robot` gives, where it is a port or a program that is there."""
    if not is_port(robot) and shutil.which(shlex.split(robot)[0]) is None:
        raise pytest.UsageError(f"--robot: found '{robot}', expected a port that is there, or a program with arguments")
    return robot


def is_port(robot):
    """Whether what is given is a port, and not a command."""
    return "://" in robot or Path(robot).is_char_device()


def _command(kind, clock):
    ours = [f"clock={clock}", "faults=none", "robot=paper"]
    if kind == "mujoco":
        return virtual_robot_command(ours)
    if kind == "firmware":
        return virtual_robot_command([*ours, f"firmware={program()}"])
    return shlex.split(kind.replace("{clock}", clock))
