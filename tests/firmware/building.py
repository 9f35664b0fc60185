"""The firmware, built for the tests; where there is no compiler they are skipped, and say so."""

import atexit
import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import pytest

from benchmarks.link_fuzz.harness import loaded

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
_MISSING = [tool for tool in ("g++", "make") if shutil.which(tool) is None]
needs_compiler = pytest.mark.skipif(bool(_MISSING), reason=f"the firmware is built by {' and '.join(_MISSING)}")


@cache
def build_folder():
    """Of this process: tests on two cores build twice, and not into each other's files."""
    folder = Path(mkdtemp(prefix="twbal-firmware-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


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
    return loaded(path)
