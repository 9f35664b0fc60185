"""Starts a virtual robot as a process of its own; who starts it learns its port and nothing else."""

import os
import select
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Self

from twbal.core.copies import is_copy, original_process
from twbal.core.errors import LinkError
from twbal.link.serial_plant import SerialPlant

_TAIL = 2000  # of its last words, for messages [bytes]
_GRACE = 2.0  # between asking it to end and ending it [s]
_DYING = 1.0  # a process that dies closes its port some time before it is gone [s]
_OPENING = b"port "

Launch = Callable[[Sequence[str], float], AbstractContextManager[str]]
"""Has a virtual robot for the length of a body, as `launch` does."""


class VirtualRobotProcess:
    """A running virtual robot.

    Attributes:
        port: path of its port; None until `wait_for_port` has returned.
        pid: of the process.
        command: that started it.
    """

    def __init__(self, command: Sequence[str]) -> None:
        """Start it, and do not wait.

        Args:
            command: program and arguments; must print `port <path>` when ready.
        """
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115, a pipe that nobody empties would block it; closed below
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            bufsize=0,  # nothing is read ahead of what `select` sees
            stderr=self._errors,
            start_new_session=True,  # Ctrl-C is for the host, which then stops the robot in good order
        )
        self.pid = self._process.pid
        self.command = tuple(command)
        self.port: str | None = None

    @classmethod
    def ready(cls, command: Sequence[str], start_timeout: float) -> Self:
        """One that has said its port; see `wait_for_port`."""
        process = cls(command)
        process.wait_for_port(start_timeout)
        return process

    @property
    def is_running(self) -> bool:
        """Whether it has not ended. A copy of the process that started it (`core.copies`) takes it to run."""
        return is_copy() or self._process.poll() is None

    def close(self) -> None:
        """End it, which is not for a copy of the process that started it. Safe to call twice."""
        if is_copy():
            return
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(_GRACE)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._errors.close()

    def last_words(self) -> str | None:
        """How it ended and the tail of what it complained of; None where it runs on."""
        try:
            code = self._process.wait(_DYING)
        except subprocess.TimeoutExpired:
            return None
        return f"It ended with exit code {code}; its last words: {self._tail()}"

    def _tail(self) -> str:
        size = self._errors.seek(0, os.SEEK_END)
        self._errors.seek(max(0, size - _TAIL))
        return self._errors.read().decode(errors="replace").strip() or "none"

    def wait_for_port(self, start_timeout: float) -> str:
        """Its port, for which it is waited if it has not said it yet.

        Args:
            start_timeout: how long that may take from now on [s].

        Raises:
            LinkError: it ended, or said nothing, and is ended then; the message has its last words.
        """
        if self.port is None:
            try:
                self.port = self._said_port(start_timeout)
            except BaseException:
                self.close()
                raise
        return self.port

    def _said_port(self, start_timeout: float) -> str:
        assert self._process.stdout is not None
        deadline = time.monotonic() + start_timeout
        while select.select([self._process.stdout], [], [], max(deadline - time.monotonic(), 0.0))[0]:
            line = self._process.stdout.readline()
            if line.startswith(_OPENING):
                return line.removeprefix(_OPENING).decode().strip()
            if not line:
                self._process.wait(max(deadline - time.monotonic(), _GRACE))
                raise LinkError(f"The virtual robot did not start. {self.last_words()}")
        raise LinkError(
            f"The virtual robot did not say its port within {start_timeout:g} s. Last words: {self._tail()}"
        )


class KeptRobots:
    """Virtual robots that one body after the other has for itself, so that their processes start once.

    Seed and trial decide all of a rollout, so that a body sees what it would see of a robot that was just started.
    Bodies within each other have a robot each. All bodies are of one thread.
    """

    def __init__(self) -> None:
        self._free: list[VirtualRobotProcess] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def begin(self, command: Sequence[str], robots: int) -> None:
        """Start robots that bodies will have later, and do not wait for them."""
        for _ in range(robots):
            self._free.append(VirtualRobotProcess(command))

    def are_ready(self, command: Sequence[str], robots: int, start_timeout: float) -> bool:
        """Whether so many robots of a command are there that no body has; it is waited until they have their ports.

        A copy of this process (`core.copies`) may then have them. One that it starts would end with it.
        """
        ready = [process for process in self._free if process.command == tuple(command) and process.is_running]
        try:
            for process in ready:
                process.wait_for_port(start_timeout)
        except LinkError:  # which is told of where the robot is launched
            return False
        return len(ready) >= robots

    @contextmanager
    def launch(self, command: Sequence[str], start_timeout: float) -> Iterator[str]:
        """A robot for the length of the body, which gets the path of its port; see the function `launch`.

        One is started where none of this command is left that still runs.
        """
        process = self._taken(command) or VirtualRobotProcess(command)
        port = process.wait_for_port(start_timeout)
        try:
            yield port
        except LinkError as error:
            words = process.last_words()
            process.close()
            if words is None:
                raise
            raise type(error)(f"{error} The virtual robot is gone. {words}") from error
        except BaseException:
            process.close()
            raise
        self._free.append(process)

    def close(self) -> None:
        """End those that no body has. Safe to call twice."""
        while self._free:
            self._free.pop().close()

    def _taken(self, command: Sequence[str]) -> VirtualRobotProcess | None:
        """A robot of the command that no body has; those of other commands, and those that have ended, are ended."""
        while self._free:
            process = self._free.pop()
            if process.command == tuple(command) and process.is_running:
                return process
            process.close()
        return None


def virtual_robot_command(overrides: Sequence[str]) -> list[str]:
    """The command line of `twbal virtual-robot`, with this interpreter and to end with this process at the latest.

    Args:
        overrides: such as `seed=3`.
    """
    return [sys.executable, "-m", "twbal", "virtual-robot", f"parent={original_process()}", *overrides]


@contextmanager
def launch(command: Sequence[str], start_timeout: float) -> Iterator[str]:
    """A virtual robot for the length of the body, which gets the path of its port.

    Args:
        command: see `virtual_robot_command`.
        start_timeout: how long it may take to say its port [s].

    Raises:
        LinkError: it did not start; or the body met a LinkError because it had ended, and then with its last words.
    """
    with KeptRobots() as robots, robots.launch(command, start_timeout) as port:
        yield port


def settings_of(robot: str, seed: int, clock: str, overrides: Sequence[str], program: str | None) -> list[str]:
    """The settings of a virtual robot, as on the command line; see `virtual_plant`."""
    settings = [f"robot={robot}", f"seed={seed}", f"clock={clock}", *overrides]
    return settings if program is None else [*settings, f"firmware={_quoted(program)}"]


@contextmanager
def virtual_plant(
    robot: str,
    seed: int,
    clock: str,
    overrides: Sequence[str],
    start_timeout: float,
    baud_rate: int,
    connect_timeout: float,
    arm_timeout: float,
    timeout: float,
    program: str | None = None,
    on_board: bool = False,
    deploy: str | None = None,
    launch: Launch = launch,
) -> Iterator[SerialPlant]:
    """The plant behind the port of a virtual robot that lives as long as the body.

    Args:
        robot: which data sheet it starts from.
        seed: of what it hides, its start poses and its noise.
        clock: `lockstep` or `real_time`.
        overrides: more settings of `twbal virtual-robot`, as on the command line.
        start_timeout: see `launch` [s].
        baud_rate: see `SerialTransport`.
        connect_timeout: see `SerialPlant` for this and the next two [s].
        arm_timeout: [s].
        timeout: [s].
        program: firmware that runs in it, of `make -C firmware`; None: twbal's own in Python.
        on_board: see `SerialPlant` for this and the next.
        deploy: command that builds the program anew, with another policy on board; None: a person does.
        launch: starts it, or has one that runs already.

    Raises:
        LinkError: see `launch` and `SerialPlant`.
    """
    with (
        launch(virtual_robot_command(settings_of(robot, seed, clock, overrides, program)), start_timeout) as port,
        SerialPlant.open(
            port, baud_rate, connect_timeout, arm_timeout, timeout, on_board=on_board, deploy=deploy
        ) as plant,
    ):
        yield plant


def _quoted(text: str) -> str:
    """A text that the command line takes as it is, whatever is in it."""
    return "'" + text.replace("'", "\\'") + "'"
