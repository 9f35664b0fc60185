"""What is hidden, in forms of its own: LuGre friction, compliant play, queues in continuous time.

A fault acts at hooks that `truth` calls; each starts afresh with every rollout. Its magnitude is that of severity 1
times the severity, so that at severity 0 it would do nothing.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import exp, pi, sin, tanh
from typing import Any, NamedTuple

import numpy as np

from benchmarks.hidden_effects.robot import STEP, Body, changed

_STIFFNESS = 300.0  # of LuGre bristles [N·m/rad per N·m of friction]


class Now(NamedTuple):
    """What a fault may see of the robot in a physics step."""

    time: float
    angles: np.ndarray
    rates: np.ndarray
    over_ground: np.ndarray
    position: float
    speed: float


@dataclass
class Hooks:
    """Where faults act; each list is empty where nothing does.

    Attributes:
        command: from the asked torque to the motors' torque, by time.
        joint: (2,) torque in the joints.
        ground: (2,) torque on the wheels from outside.
        push: force at the axle.
        gyro: tilt rate as shown. level: tilt as shown.
        imu_delay: [s].
        play: full gap [rad].
        slope: [rad].
    """

    command: list[Callable[[float, float], float]] = field(default_factory=list)
    joint: list[Callable[[Now], np.ndarray]] = field(default_factory=list)
    ground: list[Callable[[Now], np.ndarray]] = field(default_factory=list)
    push: list[Callable[[Now], float]] = field(default_factory=list)
    gyro: list[Callable[[float], float]] = field(default_factory=list)
    level: list[Callable[[float], float]] = field(default_factory=list)
    imu_delay: float = 0.0
    play: float = 0.0
    slope: float = 0.0


def lugre(kinetic: float, static: float, fade: float) -> Callable[[np.ndarray], np.ndarray]:
    """Bristles between two surfaces, for both wheels: -torque by their rates [rad/s] (Canudas de Wit 1995).

    Args:
        kinetic: friction while sliding fast [N·m].
        static: at rest [N·m].
        fade: rate over which one becomes the other [rad/s].
    """
    bristles = np.zeros(2)
    stiff = _STIFFNESS * max(static, 1e-6)

    def friction(rates: np.ndarray) -> np.ndarray:
        nonlocal bristles
        level = kinetic + (static - kinetic) * np.exp(-((rates / fade) ** 2))
        # Implicit in the bristles: stiff ones would ring at this step.
        bent = (bristles + STEP * rates) / (1.0 + STEP * np.abs(rates) * stiff / np.maximum(level, 1e-9))
        change = (bent - bristles) / STEP
        bristles = bent
        return np.asarray(-(stiff * bent + 2.0 * np.sqrt(stiff * 1e-4) * change))

    return friction


def _queue(delay: float) -> Callable[[float, float], float]:
    waiting: deque[tuple[float, float]] = deque()
    now = 0.0

    def late(u: float, time: float) -> float:
        nonlocal now
        waiting.append((time + delay, u))
        while waiting and waiting[0][0] <= time + 1e-12:
            now = waiting.popleft()[1]
        return now

    return late


def _lag(constant: float) -> Callable[[float, float], float]:
    torque = 0.0

    def slow(u: float, time: float) -> float:
        nonlocal torque
        torque += STEP / constant * (u - torque)
        return torque

    return slow


def _zone(width: float) -> Callable[[float, float], float]:
    edge = 0.02 * width + 1e-6  # a driver's zone has no sharp edge

    def dead(u: float, time: float) -> float:
        return edge * (np.logaddexp(0, (u - width) / edge) - np.logaddexp(0, (-u - width) / edge))

    return dead


def _soft_limit(limit: float) -> Callable[[float, float], float]:
    """Bends in over the last tenth of the way to the limit."""

    def limited(u: float, time: float) -> float:
        over = max(abs(u) - 0.9 * limit, 0.0)
        return float(np.sign(u)) * (min(abs(u), 0.9 * limit) + 0.1 * limit * tanh(over / (0.1 * limit)))

    return limited


@dataclass(frozen=True)
class Kind:
    """One effect.

    Attributes:
        sizes: value of each parameter at severity 1, as twbal's effect has it; the first is what severity scales.
        signed: whether its sign is drawn.
        act: puts it into the hooks.
        body: changes the body.
        neutral: value of the first parameter at which nothing happens.
    """

    sizes: dict[str, float]
    act: Callable[[Hooks, dict[str, float]], None] | None = None
    body: Callable[[Body, dict[str, float]], Body] | None = None
    signed: bool = False
    neutral: float = 0.0
    scaled: tuple[str, ...] = ()


def _add(place: str, make: Callable[..., Any]) -> Callable[[Hooks, dict[str, float]], None]:
    return lambda hooks, p: getattr(hooks, place).append(make(**p))


def _set(place: str, name: str) -> Callable[[Hooks, dict[str, float]], None]:
    return lambda hooks, p: setattr(hooks, place, p[name])


def _joint_lugre(kinetic: float, static: float, fade: float) -> Callable[[Now], np.ndarray]:
    friction = lugre(kinetic, static, fade)
    return lambda now: friction(now.rates)


def _ground_lugre(torque: float) -> Callable[[Now], np.ndarray]:
    friction = lugre(torque, torque, 1.0)
    return lambda now: friction(now.over_ground)


STRUCTURAL = {
    "dead_zone": Kind({"width": 1.0}, _add("command", lambda width: _zone(width))),
    "torque_saturation": Kind(
        {"limit": 2.5},
        _add("command", lambda limit: _soft_limit(limit)),
    ),
    "actuation_delay": Kind({"delay": 0.015}, _add("command", lambda delay: _queue(delay))),
    "motor_lag": Kind({"time_constant": 0.02}, _add("command", lambda time_constant: _lag(time_constant))),
    "battery_sag": Kind({"rate": 0.05}, _add("command", lambda rate: lambda u, t: u * exp(-rate * t))),
    "coulomb_friction": Kind({"torque": 0.3}, _add("joint", lambda torque: _joint_lugre(torque, torque, 1.0))),
    "viscous_friction": Kind(
        {"coefficient": 0.06}, _add("joint", lambda coefficient: lambda now: -coefficient * now.rates)
    ),
    "stribeck_friction": Kind(
        {"breakaway": 0.4, "torque": 0.2, "rate": 2.0},
        _add("joint", lambda breakaway, torque, rate: _joint_lugre(torque, torque + breakaway, rate)),
        scaled=("torque",),
    ),
    "backlash": Kind({"gap": 0.05}, _set("play", "gap")),
    "cogging": Kind(
        {"torque": 0.3, "count": 12.0, "phase": 0.7},
        _add("joint", lambda torque, count, phase: lambda now: torque * np.sin(count * now.angles + phase)),
    ),
    "com_offset": Kind({"angle": 0.03}, None, lambda b, p: _shifted(b, p["angle"]), signed=True),
    "ground_slope": Kind({"angle": 0.03}, _set("slope", "angle"), signed=True),
    "rolling_resistance": Kind({"torque": 0.3}, _add("ground", lambda torque: _ground_lugre(torque))),
    "rolling_viscous": Kind(
        {"coefficient": 0.06}, _add("ground", lambda coefficient: lambda now: -coefficient * now.over_ground)
    ),
    "wheel_slip": Kind({"friction": 0.08}, None, lambda b, p: changed(b, grip=p["friction"])),
    "gyro_bias": Kind({"rate": 0.06}, _add("gyro", lambda rate: lambda w: w + rate), signed=True),
    "gyro_scale": Kind({"factor": 1.2}, _add("gyro", lambda factor: lambda w: factor * w), neutral=1.0),
    "imu_mount_angle": Kind({"angle": 0.03}, _add("level", lambda angle: lambda tilt: tilt + angle), signed=True),
    "imu_delay": Kind({"delay": 0.012}, _set("imu_delay", "delay")),
    "cable_spring": Kind({"stiffness": 12.0}, _add("push", lambda stiffness: lambda now: -stiffness * now.position)),
    "periodic_disturbance": Kind(
        {"force": 5.0, "frequency": 1.3, "phase": 0.4},
        _add("push", lambda force, frequency, phase: lambda now: force * sin(2 * pi * frequency * now.time + phase)),
    ),
}
"""Effects that change the form of the equations, by twbal's names."""

SHEET = {
    "torque_gain": Kind({"gain": 0.85}, _add("command", lambda gain: lambda u, t: gain * u), neutral=1.0),
    "body_mass": Kind(
        {"factor": 1.15}, None, lambda b, p: changed(b, mass=p["factor"], inertia=p["factor"]), neutral=1.0
    ),
    "body_inertia": Kind({"factor": 1.3}, None, lambda b, p: changed(b, inertia=p["factor"]), neutral=1.0),
    "com_height": Kind({"factor": 1.15}, None, lambda b, p: changed(b, height=p["factor"]), neutral=1.0),
    "wheel_radius": Kind({"factor": 1.12}, None, lambda b, p: changed(b, radius=p["factor"]), neutral=1.0),
}
"""Numbers of the data sheet that are off."""

FOREIGN = {
    "quadratic_drag": Kind({"drag": 12.0}, _add("push", lambda drag: lambda now: -drag * now.speed * abs(now.speed))),
    "flexible_mast": Kind({"mast": 1.0}, None, lambda b, p: _with_mast(b, p["mast"])),
}
"""Effects that twbal did not know when the sets were designed."""

KNOWN_SINCE = ("quadratic_drag",)
"""Of these, the ones that it knows by now: they are left out where they are hidden."""

ALIKE = ({"coulomb_friction", "stribeck_friction"}, {"com_offset", "imu_mount_angle"})
"""Effects of which one is a case of the other, or that no data of this kind tell apart: left out together."""

ALL = {**STRUCTURAL, **SHEET, **FOREIGN}


def parameters(name: str, severity: float, rng: np.random.Generator) -> dict[str, float]:
    """The values of a hidden effect: those of severity 1, within ±30 %, scaled towards doing nothing.

    Of what limits (saturation, grip) severity scales how often it is met, so these keep their value.
    """
    kind = ALL[name]
    first = next(iter(kind.sizes))
    values = dict(kind.sizes)
    spread = 1 + 0.3 * rng.uniform(-1, 1)
    scale = severity if name not in ("torque_saturation", "wheel_slip") else 1.0
    for key in (first, *kind.scaled):
        values[key] = kind.neutral + (kind.sizes[key] - kind.neutral) * spread * scale
    if name in ("torque_saturation", "wheel_slip"):
        values[first] = kind.sizes[first] * (1 + 0.1 * rng.uniform(-1, 1)) * (1 + 0.25 * (1 - severity))
    if kind.signed and rng.uniform() < 0.5:
        values[first] = -values[first]
    return values


def _shifted(body: Body, angle: float) -> Body:
    return replace(body, offset=body.offset + angle)


def _with_mast(body: Body, mass: float) -> Body:
    return replace(body, mast=mass, mass=body.mass - mass)
