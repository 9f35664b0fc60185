"""The firmware, built for the tests; where there is no compiler they are skipped, and say so."""

import ctypes
import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import pytest

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
_MISSING = [tool for tool in ("g++", "make") if shutil.which(tool) is None]
needs_compiler = pytest.mark.skipif(bool(_MISSING), reason=f"the firmware is built by {' and '.join(_MISSING)}")


@cache
def build_folder():
    """Of this process: tests on two cores build twice, and not into each other's files."""
    return Path(mkdtemp(prefix="twbal-firmware-"))


def make(*words, folder=None):
    """What make says for these targets; they are built in `folder`, or in that of this process."""
    command = ["make", "-s", "-C", str(FIRMWARE), f"BUILD={folder or build_folder()}", *words]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@cache
def program():
    """The firmware as a program of this computer."""
    make("all")
    return build_folder() / "robot_posix"


@cache
def library():
    """The portable part as a library."""
    path = build_folder() / "harness.so"
    make(str(path))
    made = ctypes.CDLL(str(path))
    made.robot_total.restype = made.robot_difference.restype = ctypes.c_float
    made.robot_sees.argtypes = [ctypes.c_float, ctypes.c_float]
    made.robot_receive.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.c_uint32]
    made.robot_run.argtypes = [ctypes.c_uint32]
    return made
