"""Where bytes go in and out; the only file that knows pyserial."""

import errno
import os
import select
import socket
from abc import ABC, abstractmethod
from contextlib import suppress

import serial
from serial.tools import list_ports
from serial.urlhandler import protocol_socket

from twbal.core.errors import ConfigError, LinkError, LinkLostError

_POLL = 0.02  # a read waits at most this long [s]: short beside any timeout, long beside a round trip
_MOST = 4096  # that is read at once [bytes]
_BUSY = (errno.EAGAIN, errno.EBUSY)  # of the lock of another program, and of a port that is open for one alone
_WRITE_TIMEOUT = 1.0  # a line that takes no bytes for so long is dead [s]


class Transport(ABC):
    """A line of bytes to a robot.

    Attributes:
        name: of the port, for messages.
    """

    name: str

    @abstractmethod
    def read(self) -> bytes:
        """Whatever has come, after a short wait where nothing has; empty after silence.

        Raises:
            LinkLostError: the port is gone.
        """

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send `data`.

        Raises:
            LinkLostError: the port is gone, or takes nothing any more.
        """

    @abstractmethod
    def close(self) -> None:
        """Free the port. Safe to call twice."""


class SerialTransport(Transport):
    """A serial port, or whatever else pyserial reaches by URL: `/dev/ttyUSB0`, `socket://host:port`, `rfc2217://host:port`."""

    def __init__(self, port: str, baud_rate: int) -> None:
        """Open the port for this process alone.

        Args:
            port: device or URL.
            baud_rate: [bit/s].

        Raises:
            LinkError: it cannot be opened; the message lists the ports that are there.
            ConfigError: the baud rate is not positive.
        """
        self.name = port
        if not baud_rate > 0:
            raise ConfigError(f"link.baud_rate must be positive, such as 115200 bit/s; found {baud_rate}.")
        try:
            self._port = serial.serial_for_url(
                port, baudrate=baud_rate, timeout=_POLL, write_timeout=_WRITE_TIMEOUT, exclusive=True
            )
        except (OSError, ValueError, OverflowError) as error:
            raise LinkError(_cannot_open(port, error)) from error
        self._file = _file_of(self._port)
        # FTDI adapters hold bytes for up to 16 ms otherwise. What is no serial chip (a pseudo-terminal, a socket) has
        # no such mode and does not need it; pyserial turns its ENOTTY into ValueError.
        with suppress(AttributeError, NotImplementedError, OSError, ValueError):
            self._port.set_low_latency_mode(True)

    def read(self) -> bytes:
        """Whatever has come; see `Transport.read`."""
        try:
            if self._file is not None and self._port.is_open:
                return self._read_file(self._file)
            return bytes(self._port.read(self._port.in_waiting or 1))
        except BlockingIOError:
            return b""
        except OSError as error:
            raise LinkLostError(f"The port {self.name} is gone while reading: {error}.") from error

    @staticmethod
    def _read_file(file: int) -> bytes:
        """One wait and one read; by pyserial it is two of each, as its `read` waits for as many bytes as it is told."""
        if not select.select([file], [], [], _POLL)[0]:
            return b""
        data = os.read(file, _MOST)
        if not data:
            raise OSError("its other end is gone")
        return data

    def write(self, data: bytes) -> None:
        """Send `data`; see `Transport.write`.

        A process that is halted within the write finds its time over, though the line is well. So one that takes too
        long is done again: to the robot it is a message that comes twice.
        """
        try:
            try:
                self._port.write(data)
            except serial.SerialTimeoutException:
                self._port.write(data)
        except OSError as error:
            raise LinkLostError(f"The port {self.name} is gone while writing: {error}.") from error

    def close(self) -> None:
        """Close the port; see `Transport.close`."""
        self._port.close()


def _file_of(port: serial.SerialBase) -> int | None:
    """What select() and read() take; None where there is nothing of that kind.

    Of a socket pyserial never tells more than one byte waiting, and lets small messages wait for one another.
    """
    if os.name != "posix":
        return None
    if isinstance(port, protocol_socket.Serial):
        port._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return int(port._socket.fileno())
    return int(port.fileno()) if isinstance(port, serial.Serial) else None


def serial_ports() -> list[str]:
    """The serial ports that are there."""
    return [port.device for port in list_ports.comports()]


def _cannot_open(port: str, error: Exception) -> str:
    ports = ", ".join(serial_ports()) or "none"
    if _is_no_terminal(port):
        return f"{port} is no serial port. Serial ports that are there: {ports}."
    code = getattr(error, "errno", None)
    if code in _BUSY:
        return f"Cannot open the port {port}: another program has it open, such as another twbal or a serial monitor."
    why = os.strerror(code) if code else error  # pyserial's own words have the port and the reason twice
    return (
        f"Cannot open the port {port}: {why}. Serial ports that are there: {ports}. Is the robot plugged in, its "
        "port free, and may you use it (on Linux: the group dialout)?"
    )


def _is_no_terminal(port: str) -> bool:
    """Whether a path leads to something that is certainly no serial port."""
    try:
        opened = os.open(port, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY)
    except OSError:
        return False
    try:
        return not os.isatty(opened)
    finally:
        os.close(opened)
