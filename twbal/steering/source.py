"""Where keys and sticks come from."""

import os
import select
from abc import ABC, abstractmethod

from twbal.steering.request import Key, Sticks

TERMINAL = "terminal"
"""Name of the terminal, as that which was lost."""


class Source(ABC):
    """Of what a person asks for.

    Attributes:
        name: for messages; once it is lost, of what is gone.
        lost: whether nothing can come from it any more.
    """

    name: str
    lost: bool = False

    @abstractmethod
    def read(self, time: float) -> list[Key | Sticks]:
        """What has come, without waiting for it.

        Args:
            time: since the drive began [s].
        """

    def lose(self, name: str) -> None:
        """Take it that nothing can come any more.

        Args:
            name: of what is gone, for messages.
        """
        self.name, self.lost = name, True

    def _bytes(self, device: int, most: int) -> bytes:
        """At most so many bytes that have come from a device, which is lost where it ends or cannot be read."""
        if self.lost or not select.select([device], [], [], 0.0)[0]:
            return b""
        try:
            data = os.read(device, most)
        except OSError:  # ENODEV: it was unplugged; EIO: nobody holds the other end of the terminal any more
            data = b""
        self.lost = not data
        return data
