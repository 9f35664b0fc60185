"""The rate at which joints are damped, against the laws of motion as the checks of logs write them."""

import pytest

from twbal.diagnosis.settings import Settings
from twbal.io.importers.checks.mechanics import expected
from twbal.planar.joint_damping import joint_damping_rate
from twbal.planar.parameters import planar_parameters

COEFFICIENT = 0.02


def test_it_is_the_damping_times_what_a_torque_does_to_the_wheels_relative_to_the_body(paper):
    found = joint_damping_rate(planar_parameters(paper, {"viscous_friction": {"coefficient": COEFFICIENT}}))
    assert found == pytest.approx(2.0 * COEFFICIENT * expected(paper).driven, rel=1e-9)


def test_joints_without_viscous_friction_are_not_damped(paper):
    assert joint_damping_rate(planar_parameters(paper, {})) == 0.0


@pytest.mark.parametrize(("rate", "substeps"), [(0.0, 10), (10.0, 10), (267.0, 42), (1e9, 200)])
def test_stiff_joints_take_more_physics_steps(rate, substeps):
    usual = Settings(*[None] * 2, 10, *[None] * 10)
    assert usual.for_period(0.031, rate).substeps == substeps
