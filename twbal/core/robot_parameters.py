"""What a data sheet says of a robot, in SI units."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from numbers import Real
from typing import Any

from twbal.core.errors import ConfigError

GRAVITY = 9.81
"""[m/s²]"""

LEAST_VALUE, LARGEST_VALUE = 1e-9, 1e9
"""Bounds of any positive value of a robot, in SI units; both may be taken."""
LARGEST_LEAN = 1.5
"""Of an angle from the vertical, in either direction; it may be taken [rad]."""
_ROUNDING = 1e-9  # share by which the inertias of a flat plate may break their inequality


@dataclass(frozen=True)
class RobotParameters:
    """A rigid body on two driven wheels that share one axle.

    Body axes: x forward, y to the left along the axle, z up; the origin is the middle of the axle.

    Attributes:
        name: of the robot.
        body_mass: all that does not turn with the wheels [kg].
        com_height: distance of the body's centre of mass from the axle [m].
        com_offset: angle by which the centre of mass, seen from the axle, lies in front of the body's z axis [rad].
        body_inertia_pitch: of the body about its centre of mass, about y [kg·m²].
        body_inertia_roll: about x [kg·m²].
        body_inertia_yaw: about z [kg·m²].
        wheel_mass: of each wheel [kg].
        wheel_radius: [m].
        wheel_inertia: of each wheel about the axle, with the geared rotor that turns with it [kg·m²].
        wheel_width: [m].
        track: distance between the wheels' middles [m].
        torque_limit: largest command u_max, sum of both wheels [N·m].
        control_period: time for which a command is held [s].
        tolerance_factors: by value, how much more than a published one it may be off (`robot_sheet`); 1 for others. It
            says nothing of the robot itself, and robots are compared and named without it.

    A number of another library, such as NumPy's, becomes one of Python's.

    Raises:
        ConfigError: a value that no robot can have.
    """

    name: str
    body_mass: float
    com_height: float
    com_offset: float
    body_inertia_pitch: float
    body_inertia_roll: float
    body_inertia_yaw: float
    wheel_mass: float
    wheel_radius: float
    wheel_inertia: float
    wheel_width: float
    track: float
    torque_limit: float
    control_period: float
    tolerance_factors: Mapping[str, float] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or "${" in self.name:
            raise ConfigError(
                f"The name of a robot must be a text without ${{, which settings take for a reference; found "
                f"{self.name!r:.80}."
            )
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name in ("name", "tolerance_factors"):
                continue
            if not _is_number(value):
                raise ConfigError(
                    f"{item.name} of robot {self.name!r} must be a number, in SI units and without a unit; found "
                    f"{value!r:.80}."
                )
            if type(value) not in (int, float):
                object.__setattr__(self, item.name, float(value))
            if item.name == "com_offset":
                continue
            if not 0 < value < float("inf"):
                raise ConfigError(f"{item.name} of robot {self.name!r} must be positive and finite; found {value}.")
            if not LEAST_VALUE <= value <= LARGEST_VALUE:
                raise ConfigError(
                    f"{item.name} of robot {self.name!r} must lie between {LEAST_VALUE:g} and {LARGEST_VALUE:g} in SI "
                    f"units; found {value}. Was it given in others?"
                )
        if not abs(self.com_offset) <= LARGEST_LEAN:
            raise ConfigError(
                f"com_offset of robot {self.name!r} is an angle in rad, 0 where the centre of mass stands over the "
                f"axle; found {self.com_offset}. Was it given in degrees?"
            )
        check_inertias(self.name, self.body_inertia_roll, self.body_inertia_pitch, self.body_inertia_yaw)


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def check_inertias(name: str, roll: float, pitch: float, yaw: float) -> None:
    """Hold a body's inertias against the triangle inequality, which all mass distributions obey.

    Args:
        name: of the robot.
        roll: [kg·m²].
        pitch: [kg·m²].
        yaw: [kg·m²].

    Raises:
        ConfigError: they break it.
    """
    inertias = {"body_inertia_roll": roll, "body_inertia_pitch": pitch, "body_inertia_yaw": yaw}
    *others, largest = sorted(inertias, key=lambda axis: inertias[axis])
    most = sum(inertias[axis] for axis in others)
    if inertias[largest] > most * (1.0 + _ROUNDING):
        raise ConfigError(
            f"{largest} of robot {name!r} is {inertias[largest]:.6g} kg·m², more than {others[0]} and "
            f"{others[1]} together ({most:.6g}), which no body has. Are axes mixed up, or are some about the axle "
            "and not about the centre of mass?"
        )


def parameter_hash(robot: RobotParameters, effects: Sequence[Any] = (), physics_step: float = 0.0) -> str:
    """Sixteen hexadecimal digits that name a robot with its effects and the step it is integrated with.

    Args:
        robot: the data sheet.
        effects: dataclasses of numbers; their order does not count.
        physics_step: [s].
    """
    lines = sorted(_canonical_text(effect) for effect in effects)
    text = "\n".join([_canonical_text(robot), *lines, repr(float(physics_step))])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _canonical_text(record: Any) -> str:
    """Class name and fields of a dataclass; the same whether 1.0 was written 1 or 1.0."""
    values = {item.name: getattr(record, item.name) for item in fields(record) if item.compare}
    values = {name: value if isinstance(value, str) else float(value) for name, value in values.items()}
    return f"{type(record).__name__} {json.dumps(values, sort_keys=True)}"
