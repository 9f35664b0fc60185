"""`firmware/tests/harness.cpp`, the robot's side of the link as a library."""

import ctypes
from pathlib import Path


def loaded(path: Path) -> ctypes.CDLL:
    """The built library, with the types of its functions."""
    made = ctypes.CDLL(str(path))
    made.robot_total.restype = made.robot_difference.restype = ctypes.c_float
    made.robot_sees.argtypes = [ctypes.c_float, ctypes.c_float]
    made.robot_receive.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.c_uint32]
    made.robot_run.argtypes = [ctypes.c_uint32]
    return made
