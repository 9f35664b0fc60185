"""What a filter of the tilt makes of the readings of an IMU that is late, where a state is corrected at once."""

import numpy as np
import pytest

from twbal.planar.actuation import EVEN
from twbal.planar.constants import constants
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import hold
from twbal.planar.planar_state import PlanarState, turning_at
from twbal.planar.sensing import imu_settled

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
