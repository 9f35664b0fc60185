"""Where keys and sticks come from."""

from abc import ABC, abstractmethod

from twbal.steering.request import Key, Sticks


class Source(ABC):
    """Of what a person asks for.

    Attributes:
        name: for messages.
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
