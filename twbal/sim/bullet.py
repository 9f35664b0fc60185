"""PyBullet, imported without the build time that it writes to the terminal each time."""

import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from twbal.core.errors import ConfigError


@contextmanager
def _silent_stderr() -> Iterator[None]:
    """Send what compiled code writes to stderr to nowhere; Python's exceptions pass."""
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


with _silent_stderr():
    import pybullet


class Client:
    """A world of PyBullet: the module's functions, with the id of this world on every call, or two worlds meet.

    `pybullet_utils` has such a client, too; it binds a function anew for every call, which takes as long as the call.

    Raises:
        ConfigError: PyBullet has no world left.
    """

    def __init__(self) -> None:
        self._id = pybullet.connect(pybullet.DIRECT)
        if self._id < 0:
            raise ConfigError("PyBullet has no world left in this process; close plants that are no longer used.")
        self.stepSimulation = partial(pybullet.stepSimulation, self._id)  # twice as fast as with the name of the id

    def __getattr__(self, name: str) -> Any:
        bound = partial(getattr(pybullet, name), physicsClientId=self._id)
        setattr(self, name, bound)  # found at once from now on
        return bound

    def load(self, urdf: str, meshes: Mapping[str, str], flags: int = 0) -> int:
        """Load a robot and return its id.

        Args:
            urdf: text of its URDF.
            meshes: text of the files that it names, by name.
            flags: of `pybullet.loadURDF`.
        """
        with tempfile.TemporaryDirectory() as folder:  # PyBullet reads URDF from files only
            for name, text in {"robot.urdf": urdf, **meshes}.items():
                (Path(folder) / name).write_text(text)
            return int(self.loadURDF(f"{folder}/robot.urdf", flags=flags))

    def close(self) -> None:
        """Give the world back. Safe to call twice."""
        if self._id >= 0:
            pybullet.disconnect(physicsClientId=self._id)
        vars(self).clear()  # the id may be another world's next
        self._id = -1


__all__ = ["Client", "pybullet"]
