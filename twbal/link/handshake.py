"""The handshake with a robot: which version of the protocol both speak, and whether it can do what is asked of it."""

from typing import NamedTuple

from twbal.core.errors import ConfigError, ProtocolError
from twbal.link.exchange import Exchange
from twbal.link.protocol import VERSION, Hello, Welcome
from twbal.link.ranges import odd_announcement
from twbal.link.version_1 import VERSION_1


class Needs(NamedTuple):
    """What a robot must be able to do.

    Attributes:
        voltages: take voltages instead of torques.
        policy_on_board: drive by a policy of its own.
    """

    voltages: bool
    policy_on_board: bool


def greet(line: Exchange, timeout: float) -> Welcome:
    """Say hello in the line's version, and return the answer.

    Raises:
        LinkError: there is none in time [s].
    """
    hello = Hello(line.next_number(), line.version)
    welcome = line.ask(hello, timeout, until=lambda answer: isinstance(answer, Welcome))
    assert isinstance(welcome, Welcome)
    return welcome


def shake_hands(line: Exchange, port: str, timeout: float, needs: Needs) -> Welcome:
    """Agree on a version with the robot on a line, which speaks it from then on, and return what it announces.

    Args:
        line: to the robot.
        port: name of the line, for messages.
        timeout: for each answer [s].
        needs: what the robot must be able to do.

    Raises:
        ProtocolError: it speaks another version, or announces what cannot be.
        LinkError: it does not answer.
        ConfigError: it cannot do what it must.
    """
    line.version = VERSION
    welcome = greet(line, timeout)
    if welcome.version == VERSION_1:
        line.version = VERSION_1  # a robot obeys after a Hello of its own version only
        welcome = greet(line, timeout)
    if welcome.version != line.version:
        raise ProtocolError(
            f"The robot on {port} speaks version {welcome.version} of the link protocol, this "
            f"twbal versions {VERSION_1} and {VERSION}. Update the older of the two."
        )
    if odd := odd_announcement(welcome):
        raise ProtocolError(f"The robot on {port} announces what cannot be: {odd}.")
    if needs.policy_on_board and not welcome.policy:
        raise ConfigError(
            f"The robot {welcome.name} on {port} has no policy on board. Export one by `twbal "
            "export-policy`, and build its firmware with it; or set link.on_board=false."
        )
    if needs.voltages and not welcome.voltage_limit > 0:
        raise ConfigError(
            f"The robot {welcome.name} on {port} takes no voltages, and link.motor asks for them. Set "
            "link.motor=null to send torques."
        )
    return welcome


def what_changed(before: Welcome, now: Welcome) -> str:
    """What a robot says of itself that it did not say before, as part of a sentence; empty where nothing."""
    said = {field.name: (getattr(before, field.name), getattr(now, field.name)) for field in before.LAYOUT[1:]}
    return ", ".join(
        f"{name.replace('_', ' ')} {_shown(value)} instead of {_shown(former)}"
        for name, (former, value) in said.items()
        if former is not value and former != value  # what is absent is one and the same NaN
    )


def _shown(value: float | str) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
