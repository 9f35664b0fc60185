"""Which of two effects stays, told by sets that are weighed by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.configuration import conf_folder
from twbal.diagnose import select
from twbal.diagnose.candidates import Candidate, Parameter
from twbal.diagnose.fit import Fit
from twbal.diagnose.weigh import Round, Weighed

SETTINGS = instantiate(OmegaConf.load(conf_folder() / "diagnosis" / "default.yaml"))
KIN = {"dead_zone": ("coulomb_friction",)}
COLOUR = 2.0
MODEL = SimpleNamespace(put=lambda values: values)


def candidate(name):
    size = Parameter("size", "", 0.0, 1.0, 0.5, 0.0)
    return Candidate(name, (size,), (), KIN.get(name, ()), "")


def weighed(score, *names):
    """A set with this score over the whiteness that it leaves."""
    fit = Fit(MODEL, (), -score * COLOUR, None, np.zeros(8))
    return Weighed(tuple(candidate(name) for name in names), fit, np.full(4, COLOUR), 0.0)


CHOSEN = weighed(500.0, "backlash", "dead_zone")


def beside(**scores):
    """A round in which these effects were weighed beside the backlash."""
    return Round(weighed(400.0, "backlash"), [], [weighed(score, "backlash", name) for name, score in scores.items()])


def test_what_does_as_well_in_the_place_of_an_effect_is_found():
    near = beside(dead_zone=500.0, actuation_delay=495.0, cogging=480.0)
    assert select.in_its_place(CHOSEN.candidates[1], CHOSEN, [near], SETTINGS) == ["actuation_delay"]
    assert select.in_its_place(CHOSEN.candidates[0], CHOSEN, [near], SETTINGS) == []


@pytest.mark.parametrize(
    ("rivals", "left"),
    [
        ({"actuation_delay": 495.0, "cogging": 493.0, "motor_lag": 491.0}, ("backlash",)),
        ({"actuation_delay": 495.0, "cogging": 493.0, "motor_lag": 480.0}, ("backlash", "dead_zone")),
        ({"actuation_delay": 495.0, "cogging": 493.0, "coulomb_friction": 495.0}, ("backlash", "dead_zone")),
    ],
    ids=["three others", "two others", "two others and kin"],
)
def test_a_second_effect_for_which_anything_would_do_is_not_named(rivals, left, monkeypatch):
    monkeypatch.setattr(
        select, "weigh", lambda data, model, always, rest, rounds: weighed(400.0, *(c.name for c in rest))
    )
    found = select.without_nameless(None, CHOSEN, (), [beside(**rivals)], SETTINGS)
    assert found.names == left


def test_an_effect_that_gains_nothing_beside_another_goes(monkeypatch):
    scores = {("backlash",): 495.0, ("dead_zone",): 100.0}
    monkeypatch.setattr(
        select,
        "weigh",
        lambda data, model, always, rest, rounds: weighed(scores[tuple(c.name for c in rest)], *(c.name for c in rest)),
    )
    assert select.without_idle(None, CHOSEN, (), SETTINGS).names == ("backlash",)
    scores["backlash",] = 300.0
    assert select.without_idle(None, CHOSEN, (), SETTINGS).names == CHOSEN.names
