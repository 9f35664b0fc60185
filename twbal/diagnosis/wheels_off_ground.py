"""A robot that lies or hangs while its wheels turn in the air: what little that tells.

Its data sheet is changed so that the body does not move and the wheels carry nothing, which the planar model and the
physics engine take as any other robot. What is left is I φ'' = torque of the motors less drag, and `drag` names its
form.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from twbal.core.episode import Episode, Estimated
from twbal.core.errors import DataError
from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.findings import Effects

ADVICE = (
    "The robot lies in these recordings and its wheels turn in the air. That tells of motors, gears and friction, as "
    "shares of the motors' torque and of the wheels' inertia, and nothing of balance, ground, tyres or the IMU: "
    "diagnose a robot that stands or drives upright for those."
)

_LIGHT, _HEAVY = 1e-3, 1e6  # inertia of what the wheels carry, and of the body they push off, in theirs
_STILL = 0.2  # rad within which the tilt of a robot that lies stays, but for one sample in twenty
_SWING = 0.03  # rad of that without drift and noise, from which on the body swings: it hangs in its wheels
_SMOOTH = 0.1  # s, over which noise is averaged
_NOT_SEEN = ("tilt", "tilt_rate", "yaw_rate")


def wheels_in_air(episodes: Sequence[Episode], max_tilt: float) -> bool:
    """Whether the robot lies still in all episodes while its wheels turn.

    A body that hangs below its axle is no such robot: it swings when the wheels speed up, as they carry it.

    Raises:
        DataError: the robot is never upright, and its body swings.
    """
    if episodes and all(_is_down(episode, max_tilt) for episode in episodes):
        swings = [_swing(episode) for episode in episodes]
        if max(swings) > _SWING:
            worst = episodes[int(np.argmax(swings))]
            raise DataError(
                f"The robot is never upright (tilt {np.median(np.abs(np.unwrap(worst.tilt))):.3g} rad), and its body "
                f"swings by {max(swings):.2g} rad: it hangs from its axle, and does not lie still with its wheels in "
                "the air. Diagnose recordings of a robot that stands or drives upright, or fix its body."
            )
    return bool(episodes) and all(_lies(episode, max_tilt) for episode in episodes)


def held(robot: RobotParameters) -> RobotParameters:
    """The data sheet of a robot whose body is held, and whose wheels carry nothing."""
    mass = _LIGHT * robot.wheel_inertia / robot.wheel_radius**2
    inertia = _HEAVY * robot.wheel_inertia
    return replace(
        robot,
        body_mass=mass,
        wheel_mass=mass,
        com_height=_LIGHT * robot.wheel_radius,
        com_offset=0.0,
        body_inertia_pitch=inertia,
        body_inertia_roll=inertia,
        body_inertia_yaw=inertia,
    )


def without_rotors(effects: Effects) -> Effects:
    """The effects less those that do nothing where the body is held: rotors turn in space as they turn against it."""
    return {name: values for name, values in effects.items() if name != "rotor_inertia"}


def held_upright(episode: Episode) -> Episode:
    """The episode as that of a robot that is held upright, with a body that no sensor sees."""
    seen = episode.observations.copy()
    seen[:, [Observation._fields.index(name) for name in _NOT_SEEN]] = 0.0
    blind = tuple(Estimated(name, float("inf")) for name in _NOT_SEEN)
    others = tuple(e for e in episode.estimated if e.channel not in _NOT_SEEN)
    return replace(episode, observations=seen, estimated=(*others, *blind))


def _lies(episode: Episode, max_tilt: float) -> bool:
    tilt = np.unwrap(episode.tilt)
    return bool(np.median(np.abs(tilt)) > max_tilt and _range(tilt) < _STILL and _swing(episode) <= _SWING)


def _is_down(episode: Episode, max_tilt: float) -> bool:
    """Whether the robot is not upright from begin to end."""
    tilt = np.unwrap(episode.tilt)
    return bool(np.quantile(np.abs(tilt), 0.025) > max_tilt and _range(tilt) < np.pi)


def _swing(episode: Episode) -> float:
    """Range of the tilt [rad], but for one sample in twenty, without steady drift and noise."""
    from scipy.signal import detrend  # loads slowly, and few robots lie

    count = max(1, round(_SMOOTH / episode.control_period))
    return _range(uniform_filter1d(detrend(np.unwrap(episode.tilt)), count, mode="nearest"))


def _range(values: Array) -> float:
    low, high = np.quantile(values, [0.025, 0.975])
    return float(high - low)
