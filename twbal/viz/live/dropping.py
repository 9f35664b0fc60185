"""A queue to another process that drops what it has no room for, so that nobody waits."""

import fcntl
import os


class DroppingQueue:
    """The writing end of a pipe, which becomes non-blocking.

    A pipe takes a message of at most 4096 bytes (PIPE_BUF) as a whole or not at all, so that a message is never cut.

    Args:
        end: file descriptor of the writing end; closed by `close`.
        capacity: of the pipe, rounded up to a power of two of at least 4096 [bytes].

    Attributes:
        taken: messages that had room.
        dropped: messages that had none, or that nobody was there to read.
        broken: whether nobody reads any more.
    """

    def __init__(self, end: int, capacity: int) -> None:
        self.taken = self.dropped = 0
        self.broken = False
        self._end: int | None = end
        os.set_blocking(end, False)
        fcntl.fcntl(end, fcntl.F_SETPIPE_SZ, capacity)

    def put(self, message: bytes) -> bool:
        """Send a message, if there is room for it at once; returns whether there was."""
        try:
            if self._end is not None and not self.broken:
                os.write(self._end, message)
                self.taken += 1
                return True
        except BlockingIOError:
            pass
        except BrokenPipeError:
            self.broken = True
        self.dropped += 1
        return False

    def close(self) -> None:
        """Let the reader know that nothing more comes. Safe to call twice."""
        if self._end is not None:
            os.close(self._end)
            self._end = None
