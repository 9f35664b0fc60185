"""Linear-quadratic regulators without a learned model: of the data sheet, or of a linear model fitted to episodes."""

from collections.abc import Callable, Sequence

import numpy as np

from twbal.core.channels import Channels
from twbal.core.cost import Cost, SaturatingCost
from twbal.core.episode import Episode
from twbal.core.errors import ConfigError, SearchError
from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.models.dataset import transitions
from twbal.planar.linearised import sampled
from twbal.policies.linear import LinearPolicy
from twbal.search.linear_starts import regulator

_UPRIGHT = 0.35  # rad; samples beyond tell of a robot that falls, which is not linear
_RIDGE = 1e-6  # of the samples' own variance, for what they do not excite
_PHYSICAL = ("tilt", "tilt_rate", "speed")


def regulator_for(
    robot: RobotParameters,
    channels: Channels,
    cost: Cost,
    command_width: float,
    episodes: Sequence[Episode],
    progress: Callable[[str], None],
) -> LinearPolicy:
    """The regulator of a linear model of episodes; of none, or where that cannot be stabilised, of the data sheet.

    Args:
        robot: data sheet.
        channels: of the state.
        cost: whose widths price the state.
        command_width: command that costs as much as a width, as a share of the torque limit.
        episodes: of the robot; may be empty.
        progress: is told where the model cannot be stabilised.

    Raises:
        ConfigError: the state lacks a channel that is needed.
        DataError: the episodes cannot be used together.
    """
    if episodes:
        found = identified_regulator(episodes, channels, cost, command_width, robot.torque_limit)
        if found is not None:
            return found
        progress("the linear model of these episodes cannot be stabilised: the regulator is that of the data sheet")
    return data_sheet_regulator(robot, channels, cost, command_width)


def data_sheet_regulator(robot: RobotParameters, channels: Channels, cost: Cost, command_width: float) -> LinearPolicy:
    """The regulator of the data sheet's linearised equations of motion, sampled at the control period.

    Args:
        robot: data sheet.
        channels: of the state; tilt, tilt rate and speed are needed.
        cost: whose widths price the state.
        command_width: command that costs as much as a width, as a share of the torque limit.

    Raises:
        ConfigError: the state lacks a channel.
    """
    missing = [name for name in _PHYSICAL if name not in channels.names]
    if missing:
        raise ConfigError(
            f"A regulator of the data sheet needs tilt, tilt_rate and speed; the state {', '.join(channels.names)} "
            f"lacks {', '.join(missing)}. Choose a state that has them by state=..."
        )
    _check_cost(channels, cost)
    index = [channels.names.index(name) for name in _PHYSICAL]
    physical = SaturatingCost(cost.target[index], cost.widths[index])
    found = regulator(*sampled(robot), physical, command_width * robot.torque_limit)
    if found is None:
        raise SearchError(
            f"The linearised equations of robot {robot.name!r} cannot be stabilised; is its data sheet right?"
        )
    gain = np.zeros(len(channels.names))
    gain[index] = found
    return LinearPolicy(channels.names, gain, 0.0, robot.torque_limit)


def _check_cost(channels: Channels, cost: Cost) -> None:
    """Raise ConfigError where a cost is not of these channels."""
    if len(cost.widths) != len(channels.names):
        raise ConfigError(
            f"The cost is of {len(cost.widths)} channels; expected are the {len(channels.names)} of the state "
            f"({', '.join(channels.names)}). Leave cost.channels out; a channel without a width costs nothing."
        )


def identified_regulator(
    episodes: Sequence[Episode], channels: Channels, cost: Cost, command_width: float, torque_limit: float
) -> LinearPolicy | None:
    """The regulator of x' = A x + B u + c, fitted to episodes by least squares; None where it cannot be stabilised.

    With past commands among the channels the model has the delay of the robot in it. The constant is counteracted: the
    robot is held where it stands still.

    Args:
        episodes: of the robot.
        channels: of the state.
        cost: whose widths price the state.
        command_width: command that costs as much as a width, as a share of the torque limit.
        torque_limit: [N·m].

    Raises:
        DataError: the episodes cannot be used together.
        ConfigError: the state has no tilt.
    """
    data = transitions(episodes, channels)
    D = len(channels.names)
    upright = np.abs(data.inputs[:, channels.inputs.index(channels.index("tilt"))]) < _UPRIGHT
    inputs, changes = data.inputs[upright], data.targets[upright]
    if len(inputs) <= D + 2:
        return None
    fitted, constant = _least_squares(inputs, changes)  # (E, d), (E,)
    moved, selection = channels.transition_matrix, channels.selection  # (D, D + 1), (D, E)
    moved[:, list(channels.inputs)] += selection @ fitted
    A, B, c = moved[:, :D], moved[:, D], selection @ constant
    gain = regulator(A, B, cost, command_width * torque_limit)
    if gain is None:
        return None
    rest, *_ = np.linalg.lstsq(np.column_stack([np.eye(D) - A, -B]), c, rcond=1e-6)  # (x, u) that stays
    return LinearPolicy(channels.names, gain, float(rest[D] + gain @ rest[:D]), torque_limit)


def _least_squares(inputs: Array, changes: Array) -> tuple[Array, Array]:
    """Slopes (E, D + 1) and constants (E,) of changes over inputs."""
    mean, spread = inputs.mean(axis=0), inputs.std(axis=0) + 1e-12
    scaled = (inputs - mean) / spread
    normal = scaled.T @ scaled / len(scaled) + _RIDGE * np.eye(scaled.shape[1])
    slopes = np.linalg.solve(normal, scaled.T @ (changes - changes.mean(axis=0)) / len(scaled)).T / spread
    return slopes, changes.mean(axis=0) - slopes @ mean
