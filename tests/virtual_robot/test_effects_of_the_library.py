"""An effect of the library does to the planar model what the same fault does to the robot in MuJoCo."""

import numpy as np
import pytest

from twbal.core.start_pose import StartPose
from twbal.effects.eccentric_wheel import EccentricWheel
from twbal.effects.slew_limit import SlewLimit
from twbal.planar.planar_plant import PlanarPlant

STEP, PERIODS = 0.00025, 20
TILT = -0.05
SAME = {
    "eccentric_wheel": (
        EccentricWheel(0.02, 0.8),
        {"body": {"eccentricity": 0.003, "eccentric_phase": (0.8, 0.8)}},
        0.05,
    ),
    "slew_limit": (SlewLimit(100.0), {"drive": {"slew_time": 0.2}}, 0.02),
}
"""Effect, fault, and the largest difference as a share of what the effect does.

The robot in MuJoCo leaves nothing out of an eccentric wheel: what an acceleration takes varies in a turn, too."""


def regulated(plant, radius):
    """What a regulator that is pushed about commands."""
    pushes = np.repeat(np.random.default_rng(3).normal(0.0, 3.0, PERIODS // 5), 5)
    seen, found = plant.reset(0), []
    for push in pushes:
        speed = radius * (seen.wheel_rate + seen.tilt_rate)
        found.append(80 * seen.tilt + 14 * seen.tilt_rate + 6 * speed + push)
        seen = plant.step(found[-1])
    return found


def course(plant, commands):
    """Tilt, tilt rate, wheel angle and wheel rate, (T + 1, 4)."""
    seen = [plant.reset(0), *(plant.step(command) for command in commands)]
    return np.array([(s.tilt, s.tilt_rate, s.wheel_angle, s.wheel_rate) for s in seen])


@pytest.mark.parametrize("name", SAME)
def test_both_robots_change_alike(name, make, conf):
    effect, fault, share = SAME[name]
    sheet = conf("robot/paper")

    def planar(*effects):
        start = StartPose(TILT, 0.0, 0.0, 0.0)
        return PlanarPlant(robot=sheet, effects=effects, start=start, physics_step=STEP, seed=0)

    commands = regulated(planar(), sheet.wheel_radius)
    changed, without = (course(planar(*effects), commands) for effects in ([effect], []))
    other, other_without = (course(make("paper", start=TILT, **parts), commands) for parts in (fault, {}))
    does = np.abs(changed - without).max(axis=0)
    apart = np.abs(changed - without - (other - other_without)).max(axis=0)
    assert (does > [0.005, 0.05, 0.03, 0.3]).all()
    assert (apart < share * does).all()
