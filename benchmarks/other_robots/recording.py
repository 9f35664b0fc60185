"""Record a set: build its robot, hide its effects, and drive it until it stays up."""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.other_robots.drive import STEP, Law, Sensors, drive
from benchmarks.other_robots.kinds import ALL, Values, drawn_values, put
from benchmarks.other_robots.mechanics import (
    PITCH,
    ROTOR_RATE_L,
    ROTOR_RATE_R,
    SIZE,
    SPIN_L,
    SPIN_R,
    Machine,
    Q,
    V,
)
from benchmarks.other_robots.robots import (
    built,
    cascade,
    drawn_sensors,
    nominal,
    regulator,
    steady_acceleration,
    torque_unit,
)
from benchmarks.other_robots.sets import Set
from twbal.core.channels import Channels
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.robot_parameters import RobotParameters
from twbal.io.logs import write_episode

_SECONDS = 40.0
_FALLEN = 0.6
_STIFFNESSES = (1.0, 2.0, 0.5, 4.0, 1.4, 0.7, 0.25)  # of the controllers that are tried in turn
_GENTLER, _TIMES = 0.7, 6  # factor on the severity where the robot falls under all of them, and how often
_JITTER = (0.01, 0.1)  # of real sensors: range of its standard deviation over the period
_LOST_ROWS = 0.002  # share of the rows of their logs
_BUILT, _VALUES, _SENSORS, _DRIVEN, _CLOCK = range(1, 6)  # purposes of random numbers
_LOSSES = 100  # and, with the number of the episode, of the rows that are lost


class Rollout(NamedTuple):
    """What `drive` returns: `commands` of them, what was seen, given and true, and the grip that was needed."""

    commands: int
    seen: np.ndarray
    given: np.ndarray
    truth: np.ndarray
    gripped: np.ndarray


class Recorded(NamedTuple):
    """A set as it was driven.

    Attributes:
        robot: with all that is hidden. sensors: likewise. law: that drives it.
        hidden: values of the effects.
        gentler: factor on the severities of the set that kept the robot up.
        rollouts: one an episode.
        stays_up: whether it does in all of them.
    """

    robot: Machine
    sensors: Sensors
    law: Law
    hidden: dict[str, Values]
    gentler: float
    rollouts: list[Rollout]
    stays_up: bool


def record(each: Set, sheet: RobotParameters, folder: Path) -> dict[str, Any]:
    """Record a set into a folder and return its label.

    Args:
        each: the set.
        sheet: its data sheet, with the control period of the set.
        folder: where its episodes go.
    """
    recorded = driven(each, sheet)
    channels = Channels(("tilt", "tilt_rate", "speed"), sheet.wheel_radius, sheet.control_period)
    for trial, rollout in enumerate(recorded.rollouts):
        source = Provenance("hidden", "robot", seed=each.seed, trial=trial)
        episode = episode_of(rollout, each, sheet.control_period, channels, source)
        write_episode(folder / "episodes" / f"trial_{trial}.mcap", episode)
    return {
        **each._asdict(),
        "hidden": recorded.hidden,
        "gentler": recorded.gentler,
        "jitter": _jitter(each),
        "stays_up": recorded.stays_up,
        "controller": "cascade" if recorded.law.lean else "regulator",
        "robot": _finite(recorded.robot._asdict()),
        "sensor_values": recorded.sensors._asdict(),
    }


def driven(each: Set, sheet: RobotParameters) -> Recorded:
    """Drive the robot of a set, under controllers and if need be under gentler effects until it stays up."""
    found = None
    for time in range(_TIMES):
        gentler = _GENTLER**time
        for stiffness in _STIFFNESSES:
            found = _tried(each, sheet, gentler, stiffness)
            if found.stays_up:
                return found
    assert found is not None
    return found


def _tried(each: Set, sheet: RobotParameters, gentler: float, stiffness: float) -> Recorded:
    rng = each.generator(_VALUES)
    machine = built(sheet, each.tolerance, each.generator(_BUILT))
    sensors = drawn_sensors(each.sensors, sheet, each.generator(_SENSORS))
    severities = {name: gentler * severity for name, severity in each.effects.items()}
    hidden = {name: drawn_values(name, severity, sheet, rng) for name, severity in severities.items()}
    met = [name for name in hidden if ALL[name].met]
    for name, values in hidden.items():
        if name not in met:
            machine, sensors = put(name, values, machine, sensors)
    style = each.generator(_DRIVEN).uniform(size=3)
    natural = cascade if style[0] < 0.5 else regulator
    law = (regulator if each.excitation == "E" else natural)(sheet, stiffness)
    if met:
        rollouts = _rollouts(each, sheet, machine, sensors, law, hidden)
        for name in met:
            hidden[name] |= _limited(name, each.effects[name], gentler, rollouts, sheet)
            machine, sensors = put(name, hidden[name], machine, sensors)
    rollouts = _rollouts(each, sheet, machine, sensors, law, hidden)
    periods = round(_SECONDS / sheet.control_period)
    stays_up = sum(rollout.commands for rollout in rollouts) >= 0.99 * periods
    return Recorded(machine, sensors, law, hidden, gentler, rollouts, stays_up)


def _limited(name: str, severity: float, gentler: float, rollouts: list[Rollout], sheet: RobotParameters) -> Values:
    """The limit that would have been met for a share of the time in rollouts without it; a gentler one is higher."""
    share = 1.0 - ALL[name].met * severity
    if name == "wheel_slip":
        parameter, met = "friction", np.concatenate([r.gripped for r in rollouts])
    elif name == "torque_saturation":
        parameter, met = "limit", np.abs(np.concatenate([r.given for r in rollouts]))
    else:
        parameter = "rate"
        met = np.concatenate([np.abs(np.diff(r.given)) for r in rollouts]) / sheet.control_period
    return {parameter: float(np.quantile(met, share)) / gentler}


def _rollouts(
    each: Set, sheet: RobotParameters, machine: Machine, sensors: Sensors, law: Law, hidden: dict[str, Values]
) -> list[Rollout]:
    """All episodes of a set, or those up to the first in which the robot falls."""
    rng = each.generator(_DRIVEN)
    rng.uniform(size=3)
    count = 4 if each.excitation == "E" else int(rng.choice([1, 2, 4]))
    found = []
    for _ in range(count):
        periods = round(_SECONDS / count / sheet.control_period)
        start = _start(machine, rng)
        instants = _instants(periods, sheet.control_period, _jitter(each), rng)
        asked = _asked(each, sheet, periods, rng)
        noise = rng.standard_normal((periods + 1, 6))
        walk = hidden.get("gyro_bias_walk", {}).get("walk", 0.0)
        walk += rng.uniform(0.0005, 0.002) if each.has("bias walk") else 0.0
        drift = np.cumsum(walk * np.sqrt(sheet.control_period) * rng.standard_normal(periods + 1))
        lost = rng.uniform(size=periods + 1) < hidden.get("command_loss", {}).get("share", 0.0)
        found.append(Rollout(*drive(start, machine, sensors, law, instants, asked, noise, drift, lost, _FALLEN)))
        if found[-1].commands < periods:
            break
    return found


def _start(machine: Machine, rng: np.random.Generator) -> np.ndarray:
    """Upright, with a little of everything; wheels roll."""
    y = np.zeros(SIZE)
    tilt, rate, speed = rng.normal(0.0, [0.03, 0.05, 0.02])
    y[PITCH], y[Q], y[V] = tilt - machine.offset, rate, speed
    y[SPIN_L] = y[SPIN_R] = speed / machine.radius
    if machine.gap == 0.0:  # else the rotors begin at rest, within the play
        y[ROTOR_RATE_L] = y[ROTOR_RATE_R] = y[SPIN_L] - y[Q]
    return y


def _jitter(each: Set) -> float:
    """Standard deviation of the instants of a set's loop over the period."""
    return float(each.generator(_CLOCK).uniform(*_JITTER)) if each.has("jitter") else 0.0


def _instants(periods: int, period: float, jitter: float, rng: np.random.Generator) -> np.ndarray:
    """Of the loop, in steps of the physics; jitter is of each instant and does not add up."""
    late = jitter * period * rng.standard_normal(periods + 1)
    late[0] = 0.0
    places = np.round(np.arange(periods + 1) * (period / STEP))
    return (places + np.round(np.clip(late, -0.35 * period, 0.35 * period) / STEP)).astype(np.int64)


def _asked(each: Set, sheet: RobotParameters, periods: int, rng: np.random.Generator) -> np.ndarray:
    """Speed, yaw rate and disturbance that are asked for (T + 1, 3)."""
    time = sheet.control_period * np.arange(periods + 1)
    asked = np.zeros((periods + 1, 3))
    most = steady_acceleration(nominal(sheet))  # of a robot that leans by 1 rad
    if each.excitation == "E":
        unit = 20.0 * torque_unit(sheet)
        frequencies, phases = rng.uniform(0.2, 5.0, 8), rng.uniform(0.0, 2.0 * np.pi, 8)
        sines = np.sin(2.0 * np.pi * frequencies * time[:, None] + phases).sum(axis=1) * np.sqrt(2.0 / 8.0)
        signs = np.repeat(rng.choice([-1.0, 0.0, 1.0], periods // 5 + 1), 5)[: periods + 1]
        forth = rng.choice([-1.0, 1.0])
        speed = min(0.5, 0.12 * most)
        asked[:, 0] = speed * forth * np.array([0.0, 1.0, 0.0, -1.0])[(time / 3.0).astype(int) % 4]
        asked[:, 2] = unit * (0.03 * sines + 0.06 * signs)
        return asked
    asked[:, 0] = _steps(time, min(0.6, 0.15 * most), rng.uniform(0.04, 0.1) * most, rng)
    if rng.uniform() < 0.5:
        asked[:, 1] = _steps(time, 0.5, 1.0, rng)
    return asked


def _steps(time: np.ndarray, most: float, slope: float, rng: np.random.Generator) -> np.ndarray:
    """Steps of 2 to 5 s, of which a third are 0, reached at a bounded rate."""
    goal, found, until, now = 0.0, np.zeros(len(time)), 1.0, 0.0
    for k, t in enumerate(time):
        if t >= until:
            goal, until = rng.choice([0.0, 1.0, 1.0]) * rng.uniform(-most, most), t + rng.uniform(2.0, 5.0)
        step = slope * (time[1] - time[0])
        now += min(max(goal - now, -step), step)
        found[k] = now
    return found


def episode_of(rollout: Rollout, each: Set, period: float, channels: Channels, source: Provenance) -> Episode:
    """A rollout as it is logged; a log of real quality lacks some rows."""
    seen, commands = rollout.seen, rollout.given
    if each.has("lost rows"):
        rng = each.generator(_LOSSES + source.trial)
        kept = rng.uniform(size=len(seen)) >= _LOST_ROWS
        kept[0] = kept[-1] = True
        seen, commands = seen[kept], commands[kept[:-1]]
    up = abs(seen[-1, 1]) < _FALLEN
    return Episode(
        channels=channels.names,
        control_period=period,
        observations=seen,
        states=channels.states(seen, commands),
        commands=commands,
        outcome=Outcome.COMPLETED if up else Outcome.TILT_LIMIT,
        provenance=replace(source, robot=each.sheet),
    )


def _finite(values: dict[str, float]) -> dict[str, float | None]:
    return {name: value if np.isfinite(value) else None for name, value in values.items()}
