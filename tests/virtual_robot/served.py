"""A robot behind a port, in the process of its test."""

import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

from twbal.virtual_robot.firmware import Firmware
from twbal.virtual_robot.pseudo_terminal import PseudoTerminal


@contextmanager
def served(robot: Firmware, on_the_line: Callable[[bytes], bytes] = lambda said: said) -> Iterator[str]:
    """The path of its port; `on_the_line` is what becomes of what it says."""
    ended = threading.Event()

    def live(line: PseudoTerminal) -> None:
        while not ended.is_set():
            line.write(on_the_line(robot.receive(line.read(0.05) or b"", 0)))

    with closing(PseudoTerminal()) as line:
        thread = threading.Thread(target=live, args=(line,))
        thread.start()
        try:
            yield line.path
        finally:
            ended.set()
            thread.join()
