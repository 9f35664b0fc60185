import pytest

from twbal.engine.engine import substeps
from twbal.errors import ConfigError


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
