"""A set that is clearly likelier takes the place of the chosen one, told by sets with scores set by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.cli.conf_folder import conf_folder
from twbal.diagnosis import likeliest, select
from twbal.diagnosis.candidates import Candidate, Parameter
from twbal.diagnosis.hypothesis import FittedHypothesis, Round
from twbal.diagnosis.verdict import probabilities
from twbal.sysid.fit import Fit
from twbal.sysid.model import Free

SETTINGS = instantiate(OmegaConf.load(conf_folder() / "groups" / "diagnosis.yaml").default)
COLOUR = 2.0
SIZE = Parameter("size", "", 0.0, 1.0, 0.5, 0.0)


def hypothesis(score, *names, value=0.5):
    """A set with this score over the autocorrelation that it leaves, its effects of this size."""
    candidates = tuple(Candidate(name, (SIZE,), (), (), "") for name in names)
    frees = tuple(Free(c.field(SIZE), 0.0, 1.0, 0.0, np.inf, 1e-4, c.name, "size") for c in candidates)
    model = SimpleNamespace(put=lambda values: values, value=lambda field: value)
    return FittedHypothesis(candidates, Fit(model, frees, -score * COLOUR, None, np.zeros(8)), np.full(4, COLOUR), 0.0)


BASE = hypothesis(0.0)
CHOSEN = hypothesis(500.0, "actuation_delay", "coulomb_friction")


def selected(*others):
    """A selection that ended with the chosen set, although it had fitted others."""
    return select.Selection(BASE, (Round(BASE, [], list(others)),), CHOSEN)


@pytest.fixture
def ended(monkeypatch):
    """Names of the set with which a selection ends, where taking an effect off a set costs all that it gains."""
    monkeypatch.setattr(select.Problem, "add_to", lambda self, w: Round(w, [], []))
    monkeypatch.setattr(
        select, "fit_hypothesis", lambda data, model, always, rest, rounds: hypothesis(100.0, *(c.name for c in rest))
    )
    problem = select.Problem(None, None, (), (), SETTINGS)
    return lambda *others: likeliest.with_likeliest(problem, selected(*others), lambda line: None).chosen.names


def test_a_likelier_set_of_other_effects_takes_the_place(ended):
    assert ended(hypothesis(520.0, "dead_zone", "motor_lag")) == ("dead_zone", "motor_lag")


@pytest.mark.parametrize(
    "other",
    [
        hypothesis(502.0, "dead_zone", "motor_lag"),
        hypothesis(520.0, "actuation_delay", "coulomb_friction", "motor_lag"),
        hypothesis(520.0, "dead_zone", "motor_lag", value=0.9999),
        hypothesis(520.0, "dead_zone", "motor_lag", value=0.001),
    ],
    ids=["hardly likelier", "with what was chosen and more", "at a bound", "negligible"],
)
def test_no_other_set_takes_the_place(other, ended):
    assert ended(other) == CHOSEN.names


def test_what_most_of_the_weight_does_without_is_objected_to():
    selection = selected(hypothesis(520.0, "coulomb_friction", "dead_zone", "motor_lag", value=0.9999))
    (objection,) = likeliest.outweighed(selection, probabilities(selection, SETTINGS), SETTINGS)
    assert objection.effects == ("actuation_delay",)
    likely = "the likeliest is coulomb friction, dead zone, motor lag"
    assert f"without the actuation delay are likelier; {likely} (7" in objection.text


def test_an_effect_that_another_replaces_beside_the_rest_is_not_objected_to():
    selection = selected(hypothesis(505.0, "coulomb_friction", "motor_lag"))
    assert not likeliest.outweighed(selection, probabilities(selection, SETTINGS), SETTINGS)
