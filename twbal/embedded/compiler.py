"""The header compiled on this machine, to see whether it does what the policy does."""

import ctypes
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array

_FLAGS = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror", "-shared", "-fPIC")
_WRAPPER = """\
#include "policy.h"
int twbal_policy_width = TWBAL_POLICY_CHANNELS;
void commands(const float* states, int count, float* out)
{
    int n;
    for (n = 0; n < count; ++n) {
        out[n] = twbal_policy_command(states + n * TWBAL_POLICY_CHANNELS);
    }
}
void rollout(const twbal_observation* seen, const twbal_reference* asked, int count, float* states, float* out)
{
    twbal_policy_memory memory;
    int n;
    twbal_policy_reset(&memory);
    for (n = 0; n < count; ++n) {
        twbal_policy_memory before = memory;
        twbal_policy_state(&before, seen + n, asked + n, states + n * TWBAL_POLICY_CHANNELS);
        out[n] = twbal_policy_step(&memory, seen + n, asked + n);
    }
}
"""


def c_compiler() -> str | None:
    """The C compiler of this machine, `CC` or `cc` or `gcc`; None where there is none."""
    names = [name for name in (os.environ.get("CC"), "cc", "gcc", "clang") if name]
    return next((found for name in names if (found := shutil.which(name))), None)


class OneRollout(NamedTuple):
    """States and commands of one rollout, in single precision.

    Attributes:
        states: (T, D).
        commands: (T,) [N·m].
    """

    states: Array
    commands: Array


class CompiledPolicy:
    """A header as a library of this process; a context manager, which removes it from the disk.

    Attributes:
        seconds_per_call: the shortest of all `commands` so far, one call of one state [s].
    """

    def __init__(self, header: str, compiler: str) -> None:
        """Compile it; warnings are errors.

        Raises:
            ConfigError: it does not compile.
        """
        self.seconds_per_call = float("inf")
        self._folder = tempfile.TemporaryDirectory(prefix="twbal-policy-")
        folder = Path(self._folder.name)
        (folder / "policy.h").write_text(header)
        (folder / "policy.c").write_text(_WRAPPER)
        words = [compiler, *_FLAGS, "-o", str(folder / "policy.so"), str(folder / "policy.c"), "-lm"]
        done = subprocess.run(words, capture_output=True, text=True)
        if done.returncode:
            self._folder.cleanup()
            raise ConfigError(f"{compiler} does not compile the policy's header: {done.stderr.strip()[:500]}")
        self._library = ctypes.CDLL(str(folder / "policy.so"))

    def commands(self, states: Array) -> Array:
        """Commands (n,) [N·m] for states (n, D)."""
        given = np.ascontiguousarray(states, dtype=np.float32)
        found = np.empty(len(given), dtype=np.float32)
        began = time.perf_counter()
        self._library.commands(_pointer(given), ctypes.c_int(len(given)), _pointer(found))
        self.seconds_per_call = min(self.seconds_per_call, (time.perf_counter() - began) / max(len(given), 1))
        return found.astype(np.float64)

    def rollout(self, observations: Array, references: Array | None = None) -> OneRollout:
        """What it makes of the observations of a rollout.

        Args:
            observations: (T, 7) as `core.plant.Observation`.
            references: (T, 3), position, speed and whether the reference gives way; None: it stays.
        """
        seen = np.ascontiguousarray(observations, dtype=np.float64).copy()
        seen[1:, 0], seen[0, 0] = np.diff(observations[:, 0]), 0.0
        single = np.ascontiguousarray(seen, dtype=np.float32)
        asked = np.zeros(len(seen), dtype=[("position", "f4"), ("speed", "f4"), ("gives_way", "i4")])
        if references is not None:
            for column, name in enumerate(("position", "speed", "gives_way")):
                asked[name] = references[:, column]
        width = ctypes.c_int.in_dll(self._library, "twbal_policy_width").value
        states, commands = np.empty((len(seen), width), np.float32), np.empty(len(seen), np.float32)
        self._library.rollout(
            _pointer(single), _pointer(asked), ctypes.c_int(len(seen)), _pointer(states), _pointer(commands)
        )
        return OneRollout(states.astype(np.float64), commands.astype(np.float64))

    def close(self) -> None:
        """Remove the files; the library itself stays loaded."""
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


def _pointer(array: NDArray[np.generic]) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)
