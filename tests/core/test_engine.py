import pytest

from twbal.core.engine import dividing_step, substeps
from twbal.core.errors import ConfigError, DataError
from twbal.core.robot_model import DriveTrain, RobotModel


@pytest.mark.parametrize(
    ("period", "step", "count"), [(0.02, 0.001, 20), (0.015, 0.0005, 30), (0.02, 0.02, 1), (0.06, 0.001, 60)]
)
def test_a_control_period_is_a_whole_number_of_steps(period, step, count):
    assert substeps(period, step) == count


@pytest.mark.parametrize("step", [0.0, -1.0, float("nan"), float("inf")])
def test_a_step_that_is_none_is_refused(step):
    for of in (substeps, dividing_step):
        with pytest.raises(ConfigError, match="must be positive"):
            of(0.02, step)


@pytest.mark.parametrize("period", [1 / 60, 0.0166667, 1 / 70, 0.0142857, 0.0143, 1 / 333, 0.02, 0.0005, 1.0])
@pytest.mark.parametrize("bound", [0.001, 0.0003, 0.00025, 0.5])
def test_the_used_step_is_the_longest_that_divides_the_period_and_is_no_longer_than_the_bound(period, bound):
    count, step = substeps(period, bound), dividing_step(period, bound)
    assert count * step == pytest.approx(period, rel=1e-12) and step <= bound * (1 + 1e-9)
    assert count == 1 or period / (count - 1) > bound
    assert (substeps(period, step), dividing_step(period, step)) == (count, step)  # given again, it stays


def test_a_period_written_to_single_precision_has_as_many_steps_as_the_exact_one():
    assert substeps(0.05000000074505806, 0.001) == 50
    assert substeps(0.009999999776482582, 0.001) == 10


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
