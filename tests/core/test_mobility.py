"""What an impulse between wheels and body gives, against the solution of the equations of motion."""

import numpy as np
import pytest

from twbal.core.mobility import geared_mobilities, joint_mobility


@pytest.mark.parametrize("share", [0.0, 0.8])
def test_wheels_and_body_gain_what_the_mass_matrix_says(paper, share):
    """The upright robot, whose rotors have ½ g (φ̇ - θ̇)² of the energy in place of ½ g φ̇²."""
    m, l, r = paper.body_mass, paper.com_height, paper.wheel_radius
    rotors, total = 2 * share * paper.wheel_inertia, m + 2 * paper.wheel_mass
    wheels, body, tied = total * r**2 + 2 * paper.wheel_inertia, paper.body_inertia_pitch + m * l**2, m * l * r
    gained = np.linalg.solve([[wheels, tied - rotors], [tied - rotors, body + rotors]], [1.0, -1.0])
    assert geared_mobilities(paper, rotors) == pytest.approx(gained)
    if share == 0.0:
        assert joint_mobility(paper) == pytest.approx(gained[0] - gained[1])
