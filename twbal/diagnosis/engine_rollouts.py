"""Rollouts of a fitted model in PyBullet, from motions whose angles and rates belong to one instant.

PyBullet steps by the semi-implicit Euler method: a rate gains what the acceleration at the old angle makes of it, and
the angle then goes on by the new rate. So its angles run ahead of its rates by half a physics step (E. Hairer, C.
Lubich, G. Wanner: Geometric numerical integration illustrated by the Störmer-Verlet method, Acta Numerica 12, 2003,
section 1.5). At 1 ms and 3 rad/s that is 1.5 mrad, as much as a tilt that is measured well is off by.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.diagnosis.findings import FilterResult
from twbal.diagnosis.inputs import DiagnosedSimulation
from twbal.effects.library import effects_from
from twbal.sim.replay import ReplayStart
from twbal.sim.replay import replay as run_in_engine

_ANGLES, _RATES = (
    [Observation._fields.index(name) for name in names]
    for names in (("tilt", "wheel_angle"), ("tilt_rate", "wheel_rate"))
)


def replayed(
    simulation: DiagnosedSimulation, filtered: FilterResult, starts: Sequence[ReplayStart], commands: Array
) -> Array:
    """What the sensors of a fitted model show after each start under recorded commands, without noise (n, S + 1, 7).

    Args:
        simulation: robot and physics step.
        filtered: the model: its effects, and how far its measured angles run ahead of its rates.
        starts: n motions, in which angles and rates are of one instant.
        commands: (n, S, k), of k equal parts of each period [N·m].
    """
    lead, radius = 0.5 * simulation.physics_step, simulation.robot.wheel_radius
    ahead = [start_ahead(start, lead, radius) for start in starts]
    effects = effects_from(filtered.effects)
    courses = run_in_engine(simulation.robot, effects, simulation.physics_step, ahead, commands)
    courses[:, :, _ANGLES] += (filtered.angle_lead - lead) * courses[:, :, _RATES]
    return courses


def start_ahead(start: ReplayStart, lead: float, radius: float) -> ReplayStart:
    """A start whose angles run ahead of its rates by a time [s], on wheels of a radius [m]."""
    at, rest = start.initial, start.restart
    wheel_rate = (at.speed - rest.slip) / radius - at.tilt_rate
    restart = rest._replace(
        wheel_angle=rest.wheel_angle + lead * wheel_rate,
        position=rest.position + lead * at.speed,
        x=rest.x + lead * at.speed * np.cos(rest.heading),
        y=rest.y + lead * at.speed * np.sin(rest.heading),
    )
    return replace(start, initial=at._replace(tilt=at.tilt + lead * at.tilt_rate), restart=restart)
