import pytest

from twbal.core.engine import dividing_step, substeps
from twbal.core.errors import ConfigError, DataError
from twbal.core.robot_model import DriveTrain, RobotModel


@pytest.mark.parametrize(
    ("period", "step", "count"), [(0.02, 0.001, 20), (0.015, 0.0005, 30), (0.02, 0.02, 1), (0.06, 0.001, 60)]
)
def test_a_control_period_is_a_whole_number_of_steps(period, step, count):
    assert substeps(period, step) == count


@pytest.mark.parametrize(
    ("step", "advice"), [(0.0003, "0.000298507"), (0.03, "0.02"), (0.0, "positive"), (-1.0, "positive")]
)
def test_a_step_that_does_not_fit_is_refused_with_one_that_does(step, advice):
    with pytest.raises(ConfigError, match=advice):
        substeps(0.02, step)


@pytest.mark.parametrize("period", [1 / 70, 1 / 333, 0.0142857, 0.02, 0.01 / 3])
@pytest.mark.parametrize("step", [0.001, 0.0003, 0.00025, 0.5])
def test_the_advised_step_fits(period, step):
    """As it is printed, which is how a user types it; and it is no longer than what was asked for."""
    try:
        assert substeps(period, step) * step == pytest.approx(period)
    except ConfigError as error:
        advised = float(str(error).removesuffix(".").rpartition("sim.physics_step=")[2])
        assert advised <= step
        assert substeps(period, advised) * advised == pytest.approx(period)


def test_a_step_that_divides_the_period_stays():
    assert dividing_step(0.02, 0.001) == 0.001
    assert dividing_step(0.02, 0.02) == 0.02


def test_a_command_is_cut_to_the_torque_limit_and_has_to_be_finite(paper):
    model = RobotModel(paper, 2.0)
    assert [model.clip(u) for u in (-3.0, -2.0, 0.5, 1e9)] == [-2.0, -2.0, 0.5, 2.0]
    for command in (float("nan"), float("inf"), -float("inf")):
        with pytest.raises(DataError, match="finite torque; found"):
            model.clip(command)


def test_geared_rotors_cannot_have_all_of_a_wheels_inertia():
    with pytest.raises(ConfigError, match="expected less than all of it"):
        DriveTrain(geared_share=1.1)
