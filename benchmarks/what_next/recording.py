"""Short recordings of hidden robots: a first one, a repetition of it, and one under a command of `real-rollout`."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from benchmarks.other_robots.drive import STEP, Law, drive
from benchmarks.other_robots.mechanics import PITCH, SIZE, SPIN_L, SPIN_R, Q, V
from benchmarks.other_robots.recording import Recorded, Rollout, driven
from benchmarks.other_robots.robots import nominal, steady_acceleration, torque_unit
from benchmarks.other_robots.sets import Set
from twbal.core.channels import Channels
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.robot_parameters import RobotParameters
from twbal.io.logs import write_episode

SECONDS = 10.0  # of the repetition, and of the suggested experiment
FALLEN = 0.5236  # rad; where `real-rollout` ends a rollout
_GRAVITY = 9.81
_LEG = 3.0  # s for which one speed is asked for
_FIRST, _REPETITION, _SUGGESTED = 21, 22, 23  # purposes of random numbers


class Excitation(NamedTuple):
    """How a robot that balances is shaken.

    Attributes:
        multisine, prbs: standard deviation, and binary torque [N·m].
        speed: asked for [m/s].
    """

    multisine: float
    prbs: float
    speed: float


class Way(NamedTuple):
    """How a first recording is made.

    Attributes:
        size: of the disturbance and of the speed that is asked for, in the usual ones.
        seconds: for which it lasts [s].
    """

    size: float
    seconds: float


WAYS = {"usual": Way(1.0, 10.0), "quiet": Way(0.25, 10.0), "standing": Way(0.0, 10.0)}
"""To record first, by name."""


def first_and_repetition(each: Set, sheet: RobotParameters, way: Way, folder: Path) -> Recorded:
    """Record the robot of a set, and for 10 s once more in the same way, into `first` and `repetition`."""
    recorded, how = driven(each, sheet), _first(sheet, way)
    for name, purpose, seconds in (("first", _FIRST, way.seconds), ("repetition", _REPETITION, SECONDS)):
        _record(each, sheet, recorded, recorded.law, how, purpose, folder / name, seconds)
    return recorded


def again(each: Set, sheet: RobotParameters, recorded: Recorded, purpose: int, folder: Path) -> float:
    """Record the robot of a set once more as first in the usual way, with random numbers of their own purpose."""
    return _record(each, sheet, recorded, recorded.law, _first(sheet, WAYS["usual"]), purpose, folder)


def suggested(
    each: Set, sheet: RobotParameters, recorded: Recorded, settings: Mapping[str, float], folder: Path
) -> float:
    """Record the robot of a set under settings of `policy=excite`, and tell for how long it stayed up [s]."""
    width, multisine, prbs, speed = (
        settings[f"policy.{name}"] for name in ("command_width", "multisine", "prbs", "speed")
    )
    how = Excitation(multisine * sheet.torque_limit, prbs * sheet.torque_limit, speed)
    law = _law(recorded.law, sheet, width)
    return _record(each, sheet, recorded, law, how, _SUGGESTED, folder / "suggested")


def _record(
    each: Set,
    sheet: RobotParameters,
    recorded: Recorded,
    law: Law,
    how: Excitation,
    purpose: int,
    folder: Path,
    seconds: float = SECONDS,
) -> float:
    """Drive the hidden robot, write what its firmware logs, and tell for how long it stayed up [s]."""
    rng, robot = each.generator(purpose), recorded.robot
    periods = round(seconds / sheet.control_period)
    asked = _asked(how, sheet, periods, rng)
    start = np.zeros(SIZE)
    tilt, rate, speed = rng.normal(0.0, [0.03, 0.05, 0.02])
    start[PITCH], start[Q], start[V] = tilt - robot.offset, rate, speed
    start[SPIN_L] = start[SPIN_R] = speed / robot.radius
    instants = (np.arange(periods + 1) * round(sheet.control_period / STEP)).astype(np.int64)
    noise = rng.standard_normal((periods + 1, 6))
    walk = recorded.hidden.get("gyro_bias_walk", {}).get("walk", 0.0)
    drift = np.cumsum(walk * np.sqrt(sheet.control_period) * rng.standard_normal(periods + 1))
    lost = rng.uniform(size=periods + 1) < recorded.hidden.get("command_loss", {}).get("share", 0.0)
    rollout = Rollout(*drive(start, robot, recorded.sensors, law, instants, asked, noise, drift, lost, FALLEN))
    write_episode(folder / "episodes" / f"{folder.name}.mcap", _episode(rollout, each, sheet))
    return float(rollout.commands * sheet.control_period)


def _first(sheet: RobotParameters, way: Way) -> Excitation:
    """How the robot is shaken in a way to record it first."""
    unit = 20.0 * torque_unit(sheet)
    speed = min(0.5, 0.12 * steady_acceleration(nominal(sheet)))
    return Excitation(0.03 * way.size * unit, 0.06 * way.size * unit, way.size * speed)


def _asked(how: Excitation, sheet: RobotParameters, periods: int, rng: np.random.Generator) -> np.ndarray:
    """Speed, yaw rate and disturbance that are asked for (T + 1, 3)."""
    time = sheet.control_period * np.arange(periods + 1)
    frequencies, phases = rng.uniform(0.2, 5.0, 8), rng.uniform(0.0, 2.0 * np.pi, 8)
    sines = np.sin(2.0 * np.pi * frequencies * time[:, None] + phases).sum(axis=1) * np.sqrt(2.0 / 8.0)
    signs = np.repeat(rng.choice([-1.0, 0.0, 1.0], periods // 5 + 1), 5)[: periods + 1]
    asked = np.zeros((periods + 1, 3))
    legs = np.array([0.0, 1.0, 0.0, -1.0])
    asked[:, 0] = how.speed * rng.choice([-1.0, 1.0]) * legs[(time / _LEG).astype(int) % 4]
    asked[:, 2] = how.multisine * sines + how.prbs * signs
    return asked


def _law(before: Law, sheet: RobotParameters, command_width: float) -> Law:
    """The linear-quadratic regulator of the data sheet with the weights of `policy=excite`."""
    m, l, r = sheet.body_mass, sheet.com_height, sheet.wheel_radius
    a = (m + 2.0 * sheet.wheel_mass) * r**2 + 2.0 * sheet.wheel_inertia
    b, c, d = m * l * r, sheet.body_inertia_pitch + m * l**2, m * _GRAVITY * l
    det = a * c - b**2
    A = np.array([[0.0, 1.0, 0.0], [a * d / det, 0.0, 0.0], [-r * b * d / det, 0.0, 0.0]])
    B = np.array([[0.0], [-(a + b) / det], [r * (c + b) / det]])
    block = expm(sheet.control_period * np.block([[A, B], [np.zeros((1, 4))]]))
    F, G = block[:3, :3], block[:3, 3:]
    effort = np.array([[(command_width * sheet.torque_limit) ** -2.0]])
    P = solve_discrete_are(F, G, np.diag([0.1**-2.0, 1.0, 1.0]), effort)
    k = np.linalg.solve(effort + G.T @ P @ G, G.T @ P @ F)[0]
    return before._replace(
        tilt=float(-k[0]),
        rate=float(-k[1]),
        speed=float(-k[2]),
        lean=0.0,
        lean_integral=0.0,
        smooth=0.0,
        limit=sheet.torque_limit,
        fade=0.25,
    )


def _episode(rollout: Rollout, each: Set, sheet: RobotParameters) -> Episode:
    """A rollout as it is logged."""
    channels = Channels(("tilt", "tilt_rate", "speed"), sheet.wheel_radius, sheet.control_period)
    up = abs(rollout.seen[-1, 1]) < FALLEN
    return Episode(
        channels=channels.names,
        control_period=sheet.control_period,
        observations=rollout.seen,
        states=channels.states(rollout.seen, rollout.given),
        commands=rollout.given,
        outcome=Outcome.COMPLETED if up else Outcome.TILT_LIMIT,
        provenance=replace(Provenance("hidden", "robot", seed=each.seed, trial=0), robot=each.sheet),
    )
