"""The hidden function of each kind: what it adds to, which variable it depends on, and its values."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.other_robots.drive import Sensors, motor
from benchmarks.other_robots.mechanics import Machine
from benchmarks.other_robots.recording import Rollout

JOINT, OUTSIDE, TILT = "torque in the joints", "force at the axle", "tilt reading"


class Hidden(NamedTuple):
    """A function of one variable.

    Attributes:
        quantity: that it adds to, as a diagnosis calls it; a torque is that of both joints together.
        variable: that it depends on.
        at: its values [N·m, N or rad], by values of the variable.
    """

    quantity: str
    variable: str
    at: Callable[[np.ndarray], np.ndarray]


def _driven(m: Machine, command: np.ndarray) -> np.ndarray:
    """Torque of both motors beyond what the gain makes of the command."""
    even = m._replace(uneven=0.0)
    return np.array([2.0 * motor(0.5 * u, 0.0, 0, 0.0, even) - m.gain * u for u in command])


def hidden_function(name: str, m: Machine, sensors: Sensors) -> Hidden:
    """The function that a kind of `benchmarks.other_robots.kinds` hides in a robot."""
    found: Mapping[str, Hidden] = {
        "cubic_friction": Hidden(JOINT, "wheel rate", lambda z: -2.0 * m.cubic * z**3),
        "viscous_friction": Hidden(JOINT, "wheel rate", lambda z: -2.0 * m.viscous * z),
        "coulomb_friction": Hidden(JOINT, "wheel rate", lambda z: -2.0 * m.kinetic * np.sign(z)),
        "notch": Hidden(
            JOINT, "wheel angle", lambda z: 2.0 * m.notch * np.exp((np.cos(z - m.notch_at) - 1.0) / m.notch_width**2)
        ),
        "cogging": Hidden(
            JOINT,
            "wheel angle",
            lambda z: m.cog_torque * (np.sin(m.cog_count * z + m.cog_left) + np.sin(m.cog_count * z + m.cog_right)),
        ),
        "one_sided_motor": Hidden(JOINT, "command", lambda z: _driven(m, z)),
        "dead_zone": Hidden(JOINT, "command", lambda z: _driven(m, z)),
        "quadratic_drag": Hidden(OUTSIDE, "speed", lambda z: -m.drag * z * np.abs(z)),
        "spring_stop": Hidden(OUTSIDE, "position", lambda z: -m.stop * (z - np.clip(z, -m.stop_at, m.stop_at))),
        "cable_spring": Hidden(OUTSIDE, "position", lambda z: -m.cable * z),
        "gust": Hidden(OUTSIDE, "time", lambda z: 0.5 * m.gust * (1.0 + np.tanh((z - m.gust_at) / 0.25))),
        "bowed_tilt": Hidden(TILT, "tilt", lambda z: sensors.bow * z**2),
    }
    return found[name]


def visited(variable: str, rollouts: Sequence[Rollout], radius: float, period: float) -> np.ndarray:
    """True values of a variable in rollouts, one for each control period."""
    parts: Mapping[str, Callable[[Rollout], np.ndarray]] = {
        "wheel rate": lambda r: r.truth[:-1, 2] / radius - r.truth[:-1, 1],
        "wheel angle": lambda r: r.truth[:-1, 3],
        "command": lambda r: r.given,
        "speed": lambda r: r.truth[:-1, 2],
        "position": lambda r: r.truth[:-1, 4],
        "time": lambda r: period * np.arange(len(r.given)),
        "tilt": lambda r: r.truth[:-1, 0],
    }
    return np.concatenate([parts[variable](rollout) for rollout in rollouts])


def comparable(hidden: Hidden, grid: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The hidden function on a grid, less what is taken off a drawn one: its mean, and of the command its line."""
    powers = 1 if hidden.variable == "command" else 0
    off = np.polynomial.Polynomial.fit(values, hidden.at(values), powers)
    return np.asarray(hidden.at(grid) - off(grid))
