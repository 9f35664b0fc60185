"""The serial port of a robot: whether it is there, whether it may be used, and whether its driver holds bytes back."""

import grp
import os
import pwd
import stat
from pathlib import Path

from twbal.core.check import Check, CheckStatus
from twbal.link.transport import serial_ports

_LARGEST_LATENCY_MS = 4
"""Of an adapter: more than a fifth of a control period of 20 ms is late."""


def port_checks(port: str | None, sysfs: Path) -> list[Check]:
    """The port and its adapter. The port is not opened: many boards start anew when it is.

    Args:
        port: device or URL; None: no robot of one's own was named.
        sysfs: where the kernel tells of devices, `/sys`.
    """
    if port is None:
        there = ", ".join(serial_ports()) or "none"
        advice = "Add link=serial link.port=/dev/ttyUSB0, or where your robot is."
        return [
            Check(
                "serial port", CheckStatus.SKIPPED, f"link=virtual has none; ports that are there: {there}", "", advice
            )
        ]
    if "://" in port:
        return [
            Check("serial port", CheckStatus.SKIPPED, f"{port} is on the network", "", "Try it by `twbal check-link`.")
        ]
    check = port_check(Path(port), sysfs)
    return [check] if check.verdict is CheckStatus.PROBLEM else [check, latency_check(Path(port), sysfs)]


def port_check(port: Path, sysfs: Path) -> Check:
    """Whether the port is there, is one, and may be read and written.

    Args:
        port: path of the device, or a link to it.
        sysfs: see `port_checks`.
    """
    name = "serial port"
    try:
        found = port.stat()
    except OSError as error:
        there = ", ".join(serial_ports()) or "none"
        advice = f"Plug the robot in, or choose another link.port; ports that are there: {there}."
        return Check(name, CheckStatus.PROBLEM, f"{port}: {error.strerror}", "a serial port", advice)
    if not stat.S_ISCHR(found.st_mode) or _is_of_another_kind(found.st_rdev, sysfs):
        advice = "Choose another link.port, such as /dev/ttyUSB0."
        return Check(name, CheckStatus.PROBLEM, f"{port} is no serial device", "a serial port", advice)
    if not os.access(port, os.R_OK | os.W_OK, effective_ids=True):
        who = f"{_owner(found.st_uid)} and group {_group(found.st_gid)}, {stat.filemode(found.st_mode)}"
        return Check(name, CheckStatus.PROBLEM, f"{port} may not be used by you: it is of {who}", "", _permit(found))
    return Check(name, CheckStatus.OK, f"{port} is there, and you may use it")


def latency_check(port: Path, sysfs: Path) -> Check:
    """How long the port's USB adapter holds received bytes back.

    Args:
        port: path of the device, or a link to it.
        sysfs: see `port_checks`.
    """
    name, tty = "USB latency", port.resolve().name
    timer = sysfs / "bus" / "usb-serial" / "devices" / tty / "latency_timer"
    try:
        milliseconds = int(timer.read_text())
    except FileNotFoundError:
        return Check(name, CheckStatus.OK, f"{tty} has no latency timer; only some USB adapters have one")
    except (OSError, ValueError) as error:
        return Check(name, CheckStatus.WARNING, f"{timer} cannot be read ({error})")
    if milliseconds <= _LARGEST_LATENCY_MS:
        return Check(name, CheckStatus.OK, f"{milliseconds} ms")
    advice = (
        f"`setserial {port} low_latency` or `echo 1 | sudo tee {timer}`; twbal asks the driver for it, too, when it "
        "opens the port."
    )
    return Check(name, CheckStatus.WARNING, f"the adapter holds bytes for up to {milliseconds} ms", "1 ms", advice)


def _is_of_another_kind(device: int, sysfs: Path) -> bool:
    """Whether the kernel says that a device is no terminal; pseudo-terminals it does not list."""
    listed = sysfs / "dev" / "char" / f"{os.major(device)}:{os.minor(device)}"
    return listed.exists() and (listed / "subsystem").resolve().name != "tty"


def _permit(found: os.stat_result) -> str:
    """How to be let at a device: by its group, as a rule dialout."""
    group, user = _group(found.st_gid), _owner(os.geteuid())
    if not found.st_mode & stat.S_IRGRP or not found.st_mode & stat.S_IWGRP:
        return "Its group may not use it either: ask who set it up, or write an udev rule for it."
    if user in _members(found.st_gid):
        return f"You are in the group {group}, but not in this login: log out and in again."
    return f"`sudo usermod -a -G {group} {user}`, and log out and in again."


def _owner(number: int) -> str:
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return str(number)


def _group(number: int) -> str:
    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return str(number)


def _members(number: int) -> list[str]:
    try:
        return grp.getgrgid(number).gr_mem
    except KeyError:
        return []
