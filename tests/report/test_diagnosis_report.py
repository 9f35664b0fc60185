"""A diagnosis as a page and as JSON says what the record says."""

import json
from dataclasses import replace

import pytest

from twbal.diagnosis import (
    Diagnosis,
    Estimate,
    Gap,
    NamedEffect,
    Region,
    Rival,
    Shift,
    Verdict,
    Whiteness,
    headline_text,
    write_diagnosis,
)
from twbal.report.diagnosis import DiagnosisPictures, DiagnosisSetting, write_diagnosis_report

SVG = '<svg width="10pt" height="10pt" xmlns="http://www.w3.org/2000/svg"><g id="a"/></svg>'
PICTURES = DiagnosisPictures(SVG, SVG, SVG, SVG)
SETTING = DiagnosisSetting("paper", ["trial_000"], 40.0, "run/augmented.yaml", [("<b>sim</b>", "nominal & more")])
FRICTION = NamedEffect(
    "coulomb_friction",
    0.97,
    {"torque": Estimate(0.31, 0.27, 0.35, "N·m")},
    ("viscous_friction",),
    "Drive at several speeds.",
)
NAMED = Diagnosis(
    verdict=Verdict.NAMED,
    effects=(FRICTION,),
    data_sheet=(Shift("body_mass", "gain, mass and inertia", 1.02, 0.7),),
    data_sheet_class=(),
    rivals=(Rival(("coulomb_friction",), 120.0, 0.97, 1.1), Rival((), 0.0, 0.0, 9.0)),
    where=(Region("tilt", "speed", -1.0, 0.0, 50, 0.2, 1.1),),
    gap=(Gap("tilt", 0.06, 0.01, 0.009, 0.004, 0.003, 0.86), Gap("tilt", 0.15, 0.02, 0.015, 0.005, 0.004, 0.94)),
    held_out=("trial_000, 30-40 s",),
    whiteness=(Whiteness("tilt", 9.0, 1.1), Whiteness("tilt_rate", 4.0, 1.2)),
    noise={"tilt": 0.003},
    advice=("Friction <hides> behind speed.",),
)
NOTHING = replace(NAMED, verdict=Verdict.NONE, effects=(), gap=(), advice=())


def page(tmp_path, diagnosis, pictures=PICTURES):
    path = tmp_path / "report.html"
    write_diagnosis_report(path, diagnosis, SETTING, pictures)
    return path.read_text()


def test_the_json_has_the_fields_that_other_programs_read(tmp_path):
    write_diagnosis(tmp_path / "diagnosis.json", NAMED)
    record = json.loads((tmp_path / "diagnosis.json").read_text())
    assert record["verdict"] == "named"
    (effect,) = record["effects"]
    assert effect["name"] == "coulomb_friction"
    assert effect["parameters"]["torque"] == {"value": 0.31, "low95": 0.27, "high95": 0.35, "unit": "N·m"}
    assert effect["equivalents"] == ["viscous_friction"]
    gap = record["gap"]
    assert (gap["before"], gap["after"], gap["floor"], gap["closed"]) == (0.02, 0.005, 0.004, 0.94)
    assert gap["metric"] == "rms error of tilt after 0.15 s"
    assert gap["held_out"] == ["trial_000, 30-40 s"]
    assert (record["whiteness"]["before"], record["whiteness"]["after"]) == (9.0, 1.2)


def test_a_diagnosis_without_a_gap_is_still_whole(tmp_path):
    write_diagnosis(tmp_path / "diagnosis.json", NOTHING)
    assert json.loads((tmp_path / "diagnosis.json").read_text())["gap"]["closed"] is None
    assert "What is missing" not in page(tmp_path, NOTHING, DiagnosisPictures(SVG, None, None, SVG))


def test_the_page_says_what_was_named_how_surely_and_what_it_could_be_instead(tmp_path):
    html = page(tmp_path, NAMED)
    for said in ("coulomb friction", "0.31 N·m", "0.27", "0.35", "97", "viscous friction", "Drive at several speeds."):
        assert said in html
    assert "run/augmented.yaml" in html


def test_the_page_trusts_no_text(tmp_path):
    html = page(tmp_path, NAMED)
    assert "&lt;hides&gt;" in html
    assert "&lt;b&gt;sim&lt;/b&gt;" in html
    assert "<hides>" not in html


@pytest.mark.parametrize("verdict", list(Verdict))
def test_every_verdict_has_a_sentence(verdict):
    sentence = headline_text(replace(NAMED, verdict=verdict, data_sheet_class=("gain, mass and inertia",)))
    assert sentence.endswith(".")


def test_the_headline_names_effect_equivalents_and_how_much_of_the_gap_is_closed():
    said = headline_text(NAMED)
    assert "coulomb friction (or viscous friction)" in said
    assert "94 %" in said


@pytest.mark.parametrize(
    ("closed", "said"),
    [(0.51, "51 % of the gap is closed"), (0.5, "Named, not closed"), (-0.1, "0.005 rad after")],
)
def test_the_headline_tells_named_and_closed_from_named_alone(closed, said):
    gap = tuple(each._replace(closed=closed) for each in NAMED.gap)
    assert said in headline_text(replace(NAMED, gap=gap))
