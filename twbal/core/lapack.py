"""LAPACK's Cholesky routines without Python's lock, so that fits in threads do not wait for each other.

These are the very routines that `scipy.linalg.lapack` calls, and give the same bits; scipy keeps Python's lock
meanwhile, and two threads were no faster than one.
"""

import ctypes
from collections.abc import Callable

import numpy as np

from twbal.core.compiled import address_in_scipy
from twbal.core.errors import FitError
from twbal.core.gaussian import Array

_POINTER = ctypes.c_void_p
_LOWER = ctypes.c_char(b"L")


def _routine(name: str) -> Callable[..., None]:
    """A routine of LAPACK with five arguments, all by address; ctypes releases Python's lock while it runs."""
    return ctypes.CFUNCTYPE(None, *[_POINTER] * 5)(address_in_scipy("linalg.cython_lapack", name))


_dpotrf, _dpotri = _routine("dpotrf"), _routine("dpotri")


def factor(matrix: Array) -> bool:
    """Write L of A = L Lᵀ over the lower half of A (n, n), symmetric and column-major; False where there is none."""
    return _in_place(_dpotrf, matrix) == 0


def invert(factored: Array) -> None:
    """Write A⁻¹ over the lower half of its factor (n, n), as `factor` left it."""
    _in_place(_dpotri, factored)


def _in_place(routine: Callable[..., None], matrix: Array) -> int:
    """LAPACK's `info`."""
    n = len(matrix)
    if matrix.shape != (n, n) or matrix.dtype != np.float64 or not matrix.flags.f_contiguous:
        raise FitError(f"A square column-major matrix of float64 was expected; found {matrix.shape}, {matrix.dtype}.")
    size, info = ctypes.c_int(n), ctypes.c_int(0)
    at_size = ctypes.addressof(size)
    routine(ctypes.addressof(_LOWER), at_size, matrix.ctypes.data, at_size, ctypes.addressof(info))
    return info.value
