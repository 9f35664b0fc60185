"""Whether a policy was made for the robot that it is to drive, as far as it tells."""

from collections.abc import Sequence

from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters
from twbal.policies.linear import LinearPolicy
from twbal.policies.policy import BoundedPolicy, PeriodicPolicy, Policy, PolicyOfChannels

_SAME_PERIOD = 1e-6  # [s]
_PLACE = ("position", "position_integral")  # channels
_MOST_COMMAND, _LEAST_COMMAND = 1.05, 0.5  # of the robot's torque limit: a policy is made for all of it


def check_torque(policy: Policy, robot: RobotParameters) -> None:
    """Raise ConfigError where a policy commands more than the robot of a sheet takes."""
    most = float(policy.max_command) if isinstance(policy, BoundedPolicy) else 0.0
    if not most <= robot.torque_limit * (1 + 1e-9):
        raise ConfigError(
            f"The policy commands up to {most:g} N·m; the robot {robot.name!r} takes "
            f"{robot.torque_limit:g} N·m. Choose the robot that it was made for by robot=..., or make one for it."
        )


def check_made_for(policy: Policy, robot: RobotParameters) -> list[str]:
    """What speaks against a policy being made for a robot, a sentence each; none where nothing does.

    Args:
        policy: that is to drive.
        robot: its sheet.

    Raises:
        ConfigError: it was made for another control period: it would drive faster or slower than it was meant to.
    """
    period = policy.control_period if isinstance(policy, PeriodicPolicy) else None
    if period is not None and not abs(period - robot.control_period) <= _SAME_PERIOD:
        raise ConfigError(
            f"The policy was made for a control period of {period:g} s; the robot {robot.name!r} has one of "
            f"{robot.control_period:g} s. Choose the robot that it was made for, or make a policy for this one."
        )
    most = float(policy.max_command) if isinstance(policy, BoundedPolicy) else robot.torque_limit
    if _LEAST_COMMAND * robot.torque_limit <= most <= _MOST_COMMAND * robot.torque_limit:
        return []
    return [
        f"The policy commands up to {most:g} N·m; the torque limit of the robot {robot.name!r} is "
        f"{robot.torque_limit:g} N·m. Was it made for another robot?"
    ]


def other_past_commands(policy: Policy, channels: Sequence[str], robot: RobotParameters) -> list[str]:
    """What the past commands in its state tell of a policy that does not tell its control period; none: nothing.

    Args:
        policy: that is to drive.
        channels: of the state that this robot has by itself, whose past commands its control period decides.
        robot: its sheet.
    """
    own = getattr(policy, "channels", ())
    if not isinstance(policy, PeriodicPolicy) or policy.control_period is not None or not _past(own):
        return []
    if _past(own) == _past(channels):
        return []
    return [
        f"The policy reads {_past(own)} past commands; the state of the robot {robot.name!r} has {_past(channels)}, by "
        f"its control period of {robot.control_period:g} s. Was it made for another robot? If not, give its state in "
        "the overrides, such as 'state=rolling'."
    ]


def _past(channels: Sequence[str]) -> int:
    return sum(name.startswith("command_") for name in channels)


def keeps_its_place(policy: PolicyOfChannels) -> bool:
    """Whether the command of a policy depends on how far the robot has rolled."""
    if isinstance(policy, LinearPolicy):
        return any(gain != 0.0 for name, gain in zip(policy.channels, policy.gain, strict=True) if name in _PLACE)
    return any(name in _PLACE for name in policy.channels)
