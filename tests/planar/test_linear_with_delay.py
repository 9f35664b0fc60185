"""The planar model over one control period, against the closed form of the linearised equations of motion."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from twbal.core.start_pose import StartPose
from twbal.effects.library import effects_from
from twbal.planar import linearised
from twbal.planar.linearised import linearise, sampled_with_delay
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant

PERIODS = (0.0, 0.5, 1.3, 2.0)  # of the delay


def closed_form(robot, delay, ages):
    """A (3, 3) and B (K + 1, 3) by the matrix exponential; a command acts from its arrival to the next."""
    A, B = linearise(robot)
    T = robot.control_period

    def over(time):
        both = scipy.linalg.expm(time * np.block([[A, B[:, None]], [np.zeros((1, 4))]]))
        return both[:3, :3], both[:3, 3]

    whole = over(T)[0]
    acts = np.zeros((ages + 1, 3))
    for age in range(ages + 1):
        begins, ends = (min(max(delay - (age - more) * T, 0.0), T) for more in (0, 1))
        acts[age] = over(T - ends)[0] @ over(ends - begins)[1]
    return whole, acts


@pytest.mark.parametrize("late", PERIODS)
@pytest.mark.parametrize("which", ["paper", "regbot"])
def test_it_goes_to_the_closed_form_as_its_steps_get_finer(request, monkeypatch, which, late):
    robot = request.getfixturevalue(which)
    delay, ages = late * robot.control_period, 2
    model = planar_parameters(robot, {"actuation_delay": {"delay": delay}})
    A, B = closed_form(robot, delay, ages)
    gaps = []
    for steps in (5, 50, 500):
        monkeypatch.setattr(linearised, "_STEPS", steps)
        found = sampled_with_delay(model, robot.control_period, ages)
        gaps.append(max(np.abs(found.A - A).max() / np.abs(A).max(), np.abs(found.B - B).max() / np.abs(B).max()))
    assert gaps[0] < 0.05
    assert gaps[1] < 0.2 * gaps[0] + 1e-6
    assert gaps[2] < 1e-3


def test_speed_goes_by_the_wheels_of_the_data_sheet(paper):
    """A robot whose wheels are larger is faster than the speed that it shows."""
    T, factor = paper.control_period, 1.25
    larger = replace(paper, wheel_radius=factor * paper.wheel_radius)
    model = planar_parameters(paper, {"wheel_radius": {"factor": factor}})
    true, shown = sampled_with_delay(planar_parameters(larger, {}), T, 0), sampled_with_delay(model, T, 0)
    as_shown = np.array([1.0, 1.0, 1.0 / factor])
    np.testing.assert_allclose(shown.A, as_shown[:, None] * true.A / as_shown, atol=1e-8)
    np.testing.assert_allclose(shown.B, as_shown * true.B, atol=1e-8)


def test_commands_too_old_do_nothing_and_each_acts_once(paper):
    T = paper.control_period
    found = sampled_with_delay(planar_parameters(paper, {"actuation_delay": {"delay": 1.3 * T}}), T, 3)
    assert np.abs(found.B[[0, 3]]).max() < 1e-9  # the command of the period itself is not there yet
    assert (np.abs(found.B[[1, 2], 1]) > 1e-3).all()


def test_a_delay_beyond_the_ages_is_cut_to_them(paper):
    T = paper.control_period
    late, later = (
        sampled_with_delay(planar_parameters(paper, {"actuation_delay": {"delay": delay}}), T, 1)
        for delay in (T, 2.7 * T)
    )
    np.testing.assert_allclose(late.B, later.B, atol=1e-12)
    assert np.abs(late.B[0]).max() < 1e-9 < np.abs(late.B[1]).max()


def test_what_sticks_is_no_part_of_it_and_what_scales_is(paper):
    T = paper.control_period
    plain = sampled_with_delay(planar_parameters(paper, {}), T, 1)
    sticky = {"dead_zone": {"width": 3.0}, "coulomb_friction": {"torque": 0.3}}
    stuck = sampled_with_delay(planar_parameters(paper, sticky), T, 1)
    np.testing.assert_array_equal(stuck.B, plain.B)
    np.testing.assert_array_equal(stuck.A, plain.A)
    weak = sampled_with_delay(planar_parameters(paper, {"torque_gain": {"gain": 0.6}}), T, 1)
    np.testing.assert_allclose(weak.B, 0.6 * plain.B, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.08])
def test_the_balance_is_where_the_robot_stands_still(paper, angle):
    found = sampled_with_delay(planar_parameters(paper, {"com_offset": {"angle": angle}}), paper.control_period, 0)
    assert found.balance == found.true_balance == pytest.approx(-angle, abs=1e-9)


def test_the_balance_is_shown_as_the_imu_is_mounted(paper):
    effects = {"com_offset": {"angle": 0.03}, "imu_mount_angle": {"angle": 0.05}}
    found = sampled_with_delay(planar_parameters(paper, effects), paper.control_period, 0)
    assert found.true_balance == pytest.approx(-0.03, abs=1e-9)
    resting = PlanarPlant(
        robot=paper, effects=effects_from(effects), start=StartPose(-0.03, 0, 0, 0), physics_step=0.001, seed=0
    )
    assert found.balance == pytest.approx(resting.reset(0).tilt, abs=1e-9)
