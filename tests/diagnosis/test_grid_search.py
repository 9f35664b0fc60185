"""The search for play among many local optima, on recordings of the planar model with a known play."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_recordings import NOISE, synthetic_recording

from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.grid_search import improved, local_optima
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, FreeParameter, Model
from twbal.sysid.noise import NoiseModel
from twbal.sysid.prediction_error_fit import Fit

PLAYS = [(0.05, 0.7, 0.006, 0.3), (0.01, 0.25, 0.004, 0.2), (0.08, 0.4, 0.008, 0.45)]


@pytest.fixture(scope="module")
def candidate(paper):
    (found,) = (each for each in candidates_for(quick(paper)) if each.name == "backlash")
    return found


def quick(robot):
    return replace(robot, control_period=0.005)


def recorded(robot, play):
    """Values of a play, and 15 s of a robot that has it."""
    values = dict(zip(("gap", "rotor_share", "contact_time", "contact_damping"), play, strict=True))
    recording = synthetic_recording(quick(robot), {"backlash": values}, seed=3, periods=3000, tolerance=0.0)
    return {f"backlash_{name}": value for name, value in values.items()}, Data([recording], 3)


def fitted(robot, data, free_parameters=(), **values):
    """A model without play as a fit; its noise is that of the sensors, and a torque."""
    model = Model(planar_parameters(quick(robot), {}), 0.0, NoiseModel(np.array([*NOISE.values()]), np.full(2, 0.02)))
    model = model.put(values)
    kalman = data.filter(model)
    return Fit(model, free_parameters, 0.0, kalman, data.white(model, kalman))


def squared(data, fit, model):
    white = data.white(model, fit.kalman)
    return float(white @ white)


@pytest.mark.parametrize("play", PLAYS)
def test_a_play_is_found_that_explains_as_much_as_the_true_one(paper, candidate, play):
    values, data = recorded(paper, play)
    fit = fitted(paper, data)
    none, true = squared(data, fit, fit.model), squared(data, fit, fit.model.put(values))
    found = local_optima(data, fit, candidate)
    assert none - true > 300.0
    assert found[0].cost < true + 0.1 * (none - true)
    assert found[0].cost == pytest.approx(squared(data, fit, found[0].model))
    assert [each.cost for each in found[2:]] == sorted(each.cost for each in found[2:])


def test_width_and_share_make_up_for_each_other_but_not_their_product(paper, candidate):
    """What the wheels feel is the momentum of the rotors that cross the gap."""
    values, data = recorded(paper, PLAYS[0])
    best = local_optima(data, fitted(paper, data), candidate)[0].model.planar
    true = values["backlash_gap"] * values["backlash_rotor_share"]
    assert best.backlash_gap * best.backlash_rotor_share == pytest.approx(true, rel=0.15)


def test_the_second_model_has_the_data_sheet_as_it_was(paper, candidate):
    """A fit without play has pulled it: beside that, the true play explains less."""
    values, data = recorded(paper, PLAYS[0])
    free = FreeParameter("com_height", 0.1, 0.9, paper.com_height, 0.005, 1e-6)
    fit = fitted(paper, data, (free,), com_height=paper.com_height + 0.02)
    first, second, *_ = local_optima(data, fit, candidate)
    assert first.model.planar.com_height == pytest.approx(paper.com_height + 0.02)
    assert second.model.planar.com_height == pytest.approx(paper.com_height)
    as_it_was = fit.model.put({"com_height": paper.com_height})
    none, true = squared(data, fit, as_it_was), squared(data, fit, as_it_was.put(values))
    assert true < squared(data, fit, fit.model.put(values))
    assert second.cost < true + 0.1 * (none - true)


def test_where_nothing_is_loose_nothing_is_gained(paper, candidate):
    data = Data([synthetic_recording(quick(paper), {}, seed=3, periods=2000, tolerance=0.0)], 3)
    fit = fitted(paper, data)
    found = local_optima(data, fit, candidate)
    assert found[0].cost > squared(data, fit, fit.model) - 20.0


def test_values_somewhat_off_are_improved_until_none_near_is_better(paper, candidate):
    values, data = recorded(paper, PLAYS[0])
    off = {**values, "backlash_gap": 1.08 * values["backlash_gap"], "backlash_rotor_share": 0.74}
    fit = fitted(paper, data, candidate.free_parameters, **off)
    costs = [squared(data, fit, fit.model)]
    while (better := improved(data, fit, [candidate])) is not None:
        fit = fit._replace(model=better)
        costs.append(squared(data, fit, better))
    assert costs[-1] < costs[0] - 100.0
    assert 2 <= len(costs) < 20
    assert (np.diff(costs) < 0.0).all()


def test_a_value_that_begins_at_its_bound_may_leave_it(paper, candidate):
    values, data = recorded(paper, (0.05, 0.85, 0.006, 0.3))
    fit = fitted(paper, data, candidate.free_parameters, **{**values, "backlash_rotor_share": 0.9})
    better = improved(data, fit, [candidate])
    assert better is not None
    assert better.planar.backlash_rotor_share < 0.89
