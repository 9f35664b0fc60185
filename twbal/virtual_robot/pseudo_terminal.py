"""A serial port that is made of software: the robot holds one end, the other has a path like `/dev/pts/3`."""

import errno
import os
import pty
import select
import time
import tty

_ABSENT = 0.02  # how often to look whether somebody has opened the port [s]


class PseudoTerminal:
    """The robot's end.

    Attributes:
        path: of the host's end; several hosts may open it one after the other.
    """

    def __init__(self) -> None:
        self._robot_end, host_end = pty.openpty()
        tty.setraw(host_end)  # no echo, no line editing; it stays so when the next one opens it
        self.path = os.ttyname(host_end)
        os.close(host_end)  # held open, it would hide from the robot that its host has gone
        os.set_blocking(self._robot_end, False)

    def read(self, timeout: float) -> bytes | None:
        """What the host sent; empty after silence of `timeout` [s], None while no host has the port open."""
        try:
            if not select.select([self._robot_end], [], [], timeout)[0]:
                return b""
            return os.read(self._robot_end, 4096)
        except BlockingIOError:  # a host hung up, by which the port could be read, and the next one opened it
            return b""
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            time.sleep(_ABSENT)
            return None

    def write(self, data: bytes) -> None:
        """Send; what a host that does not read has no room for is lost, as on a wire."""
        try:
            os.write(self._robot_end, data)
        except OSError as error:
            if error.errno not in (errno.EAGAIN, errno.EIO):
                raise

    def close(self) -> None:
        """Hang up."""
        os.close(self._robot_end)
