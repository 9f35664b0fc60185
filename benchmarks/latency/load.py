"""Programs that do nothing but compute."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def busy(programs: int) -> Iterator[None]:
    """So many of them, at ordinary priority, while the body runs; each is a session of its own."""
    command = [sys.executable, "-S", "-c", "while True: pass"]
    running = [subprocess.Popen(command, start_new_session=True) for _ in range(programs)]
    try:
        yield
    finally:
        for program in running:
            program.kill()
        for program in running:
            program.wait()
