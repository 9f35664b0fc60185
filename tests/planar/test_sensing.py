"""What a filter of the tilt makes of the readings of an IMU that is late."""

import numpy as np
import pytest

from twbal.core.start_pose import StartPose
from twbal.effects.imu_delay import ImuDelay
from twbal.effects.tilt_filter import TiltFilter
from twbal.planar.actuation import EVEN
from twbal.planar.constants import constants
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant, hold
from twbal.planar.planar_state import PlanarState, turning_at
from twbal.planar.sensing import imu_settled, ring_length

SUBSTEPS = 20
REST = PlanarState(*(0.0,) * len(PlanarState._fields))


def forgotten(robot, late, corrected):
    """What the filter has forgotten after two control periods; after the first, the tilt rate is corrected [rad]."""
    effects = {"tilt_filter": {"rate": 1.0, "lead": 0.0}, "imu_delay": {"delay": late * robot.control_period}}
    planar = planar_parameters(robot, effects)
    k, straight, commands = constants(planar, robot.control_period / SUBSTEPS), turning_at(0.0, 0.0), np.ones(2)
    imu = imu_settled(k, REST, 4 * SUBSTEPS)
    s = hold(planar, k, REST, commands, 0, SUBSTEPS, straight, imu, EVEN)
    s = s._replace(tilt_rate=s.tilt_rate + corrected)
    imu[SUBSTEPS, 1] += corrected
    hold(planar, k, s, commands, 1, SUBSTEPS, straight, imu, EVEN)
    return imu[2 * SUBSTEPS, 2]


@pytest.mark.parametrize("late", [0.0, 0.25, 0.5, 0.8, 1.3])
def test_a_correction_is_no_torque_whatever_the_imu_is_late_by(paper, late):
    """A step of the tilt rate by a torque would count by up to half of its turn in a control period."""
    correction = 0.1
    changes = [forgotten(paper, by, correction) - forgotten(paper, by, 0.0) for by in (0.0, late)]
    assert changes[1] == pytest.approx(changes[0], abs=5e-3 * correction * paper.control_period)


@pytest.mark.parametrize("periods", [1, 2])
def test_an_imu_that_is_late_by_whole_periods_shows_what_one_on_time_has_shown(paper, periods):
    """Its accelerometer is as late as its gyro: the tilt that it takes for leaning comes no sooner."""
    commands = 8.0 * np.cos(1.3 * np.arange(20))
    tilts = []
    for late in (0.0, periods * paper.control_period):
        effects = [TiltFilter(5.0, 0.01), ImuDelay(late)]
        start = StartPose(0.02, 0.0, 0.0, 0.0)
        with PlanarPlant(robot=paper, effects=effects, start=start, physics_step=0.001, seed=0) as plant:
            tilts.append(np.array([plant.reset(0).tilt, *(plant.step(u).tilt for u in commands)]))
    on_time, behind = tilts
    assert behind[periods + 1 :] == pytest.approx(on_time[1:-periods], abs=1e-4)


@pytest.mark.parametrize("substeps", [1, 2, 5, 20])
def test_the_imu_s_past_is_long_enough_for_a_sum_over_the_period_before_it_was_read(paper, substeps):
    step = paper.control_period / substeps
    for late in np.linspace(0.0, 2.99, 300):
        planar = planar_parameters(paper, {"imu_delay": {"delay": late * paper.control_period}})
        oldest = int(late * substeps) + substeps + 1  # rows back, the first of two that are interpolated
        assert ring_length(constants(planar, step), substeps) > oldest
