"""What torques do within a control period, against closed forms and against the robot behind the seam."""

import numpy as np
import pytest
import scipy.linalg

from twbal.core.start_pose import StartPose
from twbal.effects.library import effects_from
from twbal.planar import linearised
from twbal.planar.equations import coefficients
from twbal.planar.linearised import linearise, torque_response
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant

AT_REST = StartPose(0.0, 0.0, 0.0, 0.0)
FORCE = 0.01  # N; so small that the robot stays where it is linear


def closed_form(robot):
    """(2, 2) by the matrix exponential, of the rates of body and wheels; columns as of `torque_response`.

    A torque on the wheels from outside is in the equation of the wheels alone: a φ̈ + b θ̈ = τ, b φ̈ + c θ̈ = d θ.
    """
    A, joint = linearise(robot)
    k, r = coefficients(robot), robot.wheel_radius
    outside = np.array([0.0, -k.b, r * k.c]) / (k.a * k.c - k.b**2)
    inputs = np.column_stack([joint, outside])
    both = scipy.linalg.expm(robot.control_period * np.block([[A, inputs], [np.zeros((2, 5))]]))
    return both[1:3, 3:] / [[1.0], [r]]


@pytest.mark.parametrize("which", ["paper", "regbot"])
def test_it_goes_to_the_closed_form_as_its_steps_get_finer(request, monkeypatch, which):
    robot = request.getfixturevalue(which)
    model, exact, gaps = planar_parameters(robot, {}), closed_form(robot), []
    for steps in (5, 50, 500):
        monkeypatch.setattr(linearised, "_STEPS", steps)
        gaps.append(np.abs(torque_response(model, robot.control_period) / exact - 1.0).max())
    assert gaps[0] < 0.05
    assert gaps[1] < 0.2 * gaps[0] + 1e-6
    assert gaps[2] < 1e-3


@pytest.mark.parametrize("which", ["paper", "regbot"])
def test_a_torque_from_outside_moves_the_rates_as_a_constant_force_at_the_axle(request, which):
    robot = request.getfixturevalue(which)
    constant = {"periodic_disturbance": {"force": FORCE, "frequency": 0.0, "phase": np.pi / 2}}
    plant = PlanarPlant(
        robot=robot,
        effects=effects_from(constant),
        start=AT_REST,
        physics_step=robot.control_period / 40,
        seed=0,
    )
    plant.reset(0)
    seen = plant.step(0.0)
    rates = np.array([seen.tilt_rate, seen.wheel_rate + seen.tilt_rate])
    said = torque_response(planar_parameters(robot, {}), robot.control_period)[:, 1] * FORCE * robot.wheel_radius
    np.testing.assert_allclose(said, rates, rtol=0.02)


def test_the_balance_angle_and_friction_change_nothing(paper):
    effects = {"com_offset": {"angle": 0.1}, "coulomb_friction": {"torque": 0.3}, "dead_zone": {"width": 2.0}}
    plain, other = (torque_response(planar_parameters(paper, e), paper.control_period) for e in ({}, effects))
    np.testing.assert_allclose(other, plain, rtol=1e-5)
