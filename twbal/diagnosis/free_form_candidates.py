"""What a free-form effect may be: an added torque, force or reading, as a function of one variable."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array, Mask
from twbal.planar.constants import constants
from twbal.sysid.kalman import Filter
from twbal.sysid.kalman_predictor import PredictorOutput
from twbal.sysid.model import Data, Model

_FRACTIONS = (np.arange(5) + 0.5) / 5  # of a control period, over which a function is averaged
_TURN = 2.0 * np.pi

JOINT, OUTSIDE, TILT = "torque in the joints", "force at the axle", "tilt reading"
UNITS = {JOINT: "N·m", OUTSIDE: "N", TILT: "rad"}
"""Quantities that a free-form effect adds to, with their units; the torque is that of both joints together."""

_FRICTIONS = (
    *("coulomb_friction", "viscous_friction", "stribeck_friction", "friction_feedforward"),
    *("rolling_resistance", "rolling_viscous"),
)
_OF_COMMAND = ("dead_zone", "torque_saturation", "friction_compensation")
_OF_PLACE = ("cable_spring", "ground_waves", "eccentric_wheel")
_OF_TIME = ("periodic_disturbance", "battery_sag")


class FreeFormCandidate(NamedTuple):
    """A quantity that may depend on a variable in a way that no effect of the library has.

    Attributes:
        quantity: one of `UNITS`.
        variable: its name.
        unit: of the variable.
        replaces: effects of the library that are functions of this variable, too.
        is_periodic: whether the variable counts modulo a turn.
        is_beside_line: whether the function is drawn less its straight line, as that is a value of the data sheet.
    """

    quantity: str
    variable: str
    unit: str
    replaces: tuple[str, ...] = ()
    is_periodic: bool = False
    is_beside_line: bool = False

    @property
    def quantity_unit(self) -> str:
        """Unit of the quantity."""
        return UNITS[self.quantity]

    @property
    def text(self) -> str:
        """As it stands in a sentence."""
        return f"{self.quantity} over the {self.variable}"


CANDIDATES = (
    FreeFormCandidate(JOINT, "wheel rate", "rad/s", _FRICTIONS),
    FreeFormCandidate(JOINT, "wheel angle", "rad", ("cogging", "eccentric_wheel"), is_periodic=True),
    FreeFormCandidate(JOINT, "tilt", "rad"),
    FreeFormCandidate(JOINT, "tilt rate", "rad/s"),
    FreeFormCandidate(JOINT, "command", "N·m", _OF_COMMAND, is_beside_line=True),
    FreeFormCandidate(JOINT, "time", "s", _OF_TIME),
    FreeFormCandidate(OUTSIDE, "speed", "m/s", (*_FRICTIONS, "quadratic_drag")),
    FreeFormCandidate(OUTSIDE, "position", "m", _OF_PLACE),
    FreeFormCandidate(OUTSIDE, "time", "s", _OF_TIME),
    FreeFormCandidate(TILT, "tilt", "rad"),
    FreeFormCandidate(TILT, "tilt rate", "rad/s"),
    FreeFormCandidate(TILT, "speed", "m/s"),
    FreeFormCandidate(TILT, "command", "N·m"),
    FreeFormCandidate(TILT, "time", "s"),
)
"""All that are tried, one at a time."""


class VariableSeries(NamedTuple):
    """A variable over a recording.

    Attributes:
        within: (T, F) in each control period, at F instants; (T, F, 2) at both wheels where they differ.
        at: (T + 1,) at the instants of the measurements, from the measurements before.
    """

    within: Array
    at: Array


def courses(
    data: Data, model: Model, kalman: Filter, predictions: Sequence[PredictorOutput]
) -> dict[str, list[VariableSeries]]:
    """The variables over each recording, by name: what the model sees at an instant, and expects a period later.

    No value depends on a measurement that it is to explain: that would be correlated with its noise.
    """
    made: list[dict[str, VariableSeries]] = [
        _courses(data, model, kalman, number, prediction) for number, prediction in enumerate(predictions)
    ]
    return {name: [each[name] for each in made] for name in made[0]}


def _courses(
    data: Data, model: Model, kalman: Filter, number: int, prediction: PredictorOutput
) -> dict[str, VariableSeries]:
    recording = data.recordings[number]
    count = len(recording)
    k = constants(model.planar, data.period)
    gains = kalman.gains[np.minimum(np.arange(count + 1), len(kalman.gains) - 1), :4]  # (T + 1, 4, 4)
    now = prediction.states[:, :4]  # tilt, wheel, tilt rate, wheel speed
    expected = now - np.einsum("tij,tj->ti", gains, prediction.errors)
    place = prediction.states[:, 8]
    ahead = place - k.radius * (now[:, 1] - expected[:, 1])
    functions: dict[str, tuple[Array, Array]] = {
        "wheel rate": (now[:, 3] - now[:, 2], expected[:, 3] - expected[:, 2]),
        "tilt": (now[:, 0], expected[:, 0]),
        "tilt rate": (now[:, 2], expected[:, 2]),
        "speed": (k.radius * now[:, 3], k.radius * expected[:, 3]),
        "position": (place, ahead),
        "time": (data.period * np.arange(count + 1.0),) * 2,
    }
    found = {name: VariableSeries(_between(begin, end), end) for name, (begin, end) in functions.items()}
    apart = k.apart * recording.heading
    angle = _between(now[:, 1] - now[:, 0], expected[:, 1] - expected[:, 0])
    both = np.stack([angle - apart[:-1, None], angle + apart[:-1, None]], axis=-1)
    found["wheel angle"] = VariableSeries(both, expected[:, 1] - expected[:, 0])
    late = _delayed(recording.commands, k.delay / data.period)
    found["command"] = VariableSeries(late[:, None], np.append(late[:1], late))
    return found


def _between(begin: Array, end: Array) -> Array:
    """Values (T, F) within control periods, from those at their begin and what is expected of their end."""
    return np.asarray(begin[:-1, None] + _FRACTIONS * (end[1:] - begin[:-1])[:, None])


def _delayed(commands: Array, late: float) -> Array:
    """Mean of the command that arrives in each control period, by a delay in periods; 0 before the first."""
    whole, share = int(late), late - int(late)
    padded = np.concatenate([np.zeros(whole + 1), commands])
    count = len(commands)
    return np.asarray((1.0 - share) * padded[1 : count + 1] + share * padded[:count])


def values_of(course: Sequence[VariableSeries], usable: Sequence[Mask], is_periodic: bool) -> Array:
    """Values of a variable at all instants that count, (n,); of an angle, within a turn."""
    found = np.concatenate([each.at[1:][use[1:]] for each, use in zip(course, usable, strict=True)])
    return np.asarray(found % _TURN if is_periodic else found)


def means_over(functions: Callable[[Array], Array], course: VariableSeries) -> Array:
    """Means of functions (..., m) of a variable over each control period, and over both wheels, (T, m)."""
    values = functions(course.within)
    return np.asarray(values.mean(axis=tuple(range(1, values.ndim - 1))))
