"""What is known of a robot before it is driven: by its sheet, and by a simulation of it."""

import numpy as np
import pytest

from twbal.effects.library import library
from twbal.effects.parameter import parameters_of
from twbal.planar.parameters import field_of
from twbal.planar.robot_distribution import prior_of


def sd(known, field):
    return np.sqrt(known.covariance.diagonal())[known.fields.index(field)]


def mean(known, field):
    return known.mean[known.fields.index(field)]


def test_a_simulation_without_effects_tells_no_more_than_the_sheet(paper):
    sheet, found = prior_of(paper), prior_of(paper, {})
    assert found.fields == sheet.fields
    for name in ("mean", "covariance", "low", "high", "filter_rate"):
        np.testing.assert_array_equal(getattr(found, name), getattr(sheet, name))


def test_what_a_simulation_was_given_is_nearly_right(paper):
    sheet, found = prior_of(paper), prior_of(paper, {"torque_gain": {"gain": 0.4}, "dead_zone": {"width": 2.0}})
    assert (mean(found, "torque_gain_gain"), mean(found, "dead_zone_width")) == (0.4, 2.0)
    assert 0.05 < sd(found, "torque_gain_gain") < 0.1 < sd(sheet, "torque_gain_gain")
    assert 0.2 < sd(found, "dead_zone_width") < sd(sheet, "dead_zone_width")
    for field in ("coulomb_friction_torque", "actuation_delay_delay"):
        assert (mean(found, field), sd(found, field)) == (mean(sheet, field), sd(sheet, field))


def test_a_value_beyond_the_bounds_of_the_sheet_moves_them(paper):
    found = prior_of(paper, {"torque_gain": {"gain": 0.1}})
    assert found.low[found.fields.index("torque_gain_gain")] == 0.1


@pytest.mark.parametrize("effect", sorted(library()))
def test_every_effect_of_the_planar_model_can_be_known(paper, effect):
    parameters = parameters_of(library()[effect])
    values = {name: parameter.value for name, parameter in parameters.items()}
    found = prior_of(paper, {effect: values})
    assert (found.low <= found.mean).all() and (found.mean <= found.high).all()
    assert np.isfinite(found.covariance).all() and (found.covariance.diagonal() > 0.0).all()
    models = found.models(50, np.random.default_rng(0))
    for name, value in values.items():
        field = field_of(effect, name)
        if effect != "tilt_filter" and value != parameters[name].neutral:
            drawn = np.array([getattr(model, field) for model in models])
            assert drawn[0] == value and np.ptp(drawn) > 0.0
    if effect == "tilt_filter":
        assert found.filter_rate[0] == values["rate"]


def test_an_effect_that_does_nothing_is_no_number(paper):
    assert prior_of(paper, {"cable_spring": {"stiffness": 0.0}}).fields == prior_of(paper).fields
