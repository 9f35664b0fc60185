"""A diagnosis as a page and as JSON says what the record says."""

import json
from dataclasses import fields, replace

import pytest

from twbal.diagnosis.advice import UNCONFIRMED
from twbal.diagnosis.diagnosis_file import concluded, write_diagnosis
from twbal.diagnosis.findings import Findings
from twbal.diagnosis.follow_up import Disagreement, NextExperiment
from twbal.diagnosis.free_form_record import FreeForm
from twbal.diagnosis.pipeline import _reviewed
from twbal.diagnosis.record import (
    GIVEN_EFFECTS,
    Diagnosis,
    Estimate,
    Gap,
    ProbableEffect,
    Region,
    Remaining,
    ResidualAutocorrelation,
    Rival,
    Shift,
    Verdict,
)
from twbal.viz.canvas import svg
from twbal.viz.diagnosis_page import DiagnosisSetting, write_diagnosis_report
from twbal.viz.free_form_figure import free_form_figure
from twbal.viz.headline import effect_lines, headline_text

SVG = '<svg width="10pt" height="10pt" xmlns="http://www.w3.org/2000/svg"><g id="a"/></svg>'
PICTURES = dict.fromkeys(("where", "rivals", "gap", "whiteness"), SVG)
UNITS = {"tilt": "rad", "tilt_rate": "rad/s"}
FACTS = [("<b>sim</b>", "nominal & more")]
SETTING = DiagnosisSetting("paper", ["trial_000"], 40.0, "run/augmented.yaml", UNITS, FACTS)
FRICTION = ProbableEffect(
    "coulomb_friction",
    0.97,
    True,
    {"torque": Estimate(0.31, 0.27, 0.35, "N·m")},
    ("viscous_friction",),
    "Drive at several speeds.",
)
NAMED = Diagnosis(
    verdict=Verdict.NAMED,
    effects=(FRICTION,),
    remaining=Remaining(0.25, True, (Region("wheel_rate", "speed", 0.5, 1.0, 40, 0.3, 3.2),)),
    added=("coulomb_friction",),
    data_sheet=(Shift("body_mass", "gain, mass and inertia", 1.02, 0.7),),
    data_sheet_class=(),
    rivals=(Rival(("coulomb_friction",), 120.0, 0.97, 1.1), Rival((), 0.0, 0.0, 9.0)),
    where=(Region("tilt", "speed", -1.0, 0.0, 50, 0.2, 1.1),),
    gap=(
        Gap("tilt", 0.06, 0.01, 0.009, 0.004, 0.003, 0.86, 0.003, -3.0),
        Gap("tilt", 0.15, 0.02, 0.012, 0.008, 0.004, 0.75, 0.004, -3.0),
    ),
    held_out=("trial_000, 30-40 s",),
    autocorrelation=(ResidualAutocorrelation("tilt", 9.0, 1.1), ResidualAutocorrelation("tilt_rate", 4.0, 1.2)),
    noise={"tilt": 0.003},
    advice=("Friction <hides> behind speed.",),
)
NOTHING = replace(NAMED, verdict=Verdict.NONE, effects=(), added=(), gap=(), advice=())


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
    assert (gap["before"], gap["after"], gap["floor"], gap["closed"]) == (0.02, 0.008, 0.004, 0.75)
    assert (gap["closed_by_refit"], gap["closed_by_effects"]) == pytest.approx((0.5, 0.25))
    assert gap["added"] == ["coulomb_friction"]
    assert gap["all"][0]["noise_floor"] == 0.003
    assert gap["metric"] == "rms error of tilt after 0.15 s"
    assert gap["held_out"] == ["trial_000, 30-40 s"]
    left = record["whiteness"]  # the key of schema 2 for the residual autocorrelation
    assert (left["before"], left["after"]) == (9.0, 1.2)
    assert left["channels"][0] == {"channel": "tilt", "before": 9.0, "after": 1.1}
    assert [rival["whiteness"] for rival in record["rivals"]] == [1.1, 9.0]
    assert "autocorrelation" not in json.dumps(record)


def test_a_diagnosis_without_a_gap_is_still_whole(tmp_path):
    write_diagnosis(tmp_path / "diagnosis.json", NOTHING)
    assert json.loads((tmp_path / "diagnosis.json").read_text())["gap"]["closed"] is None
    assert "What is missing" not in page(tmp_path, NOTHING, {"where": SVG, "whiteness": SVG})


def test_the_page_says_what_was_named_how_surely_and_what_it_could_be_instead(tmp_path):
    html = page(tmp_path, NAMED)
    for said in ("coulomb friction", "0.31 N·m", "0.27", "0.35", "97", "viscous friction", "Drive at several speeds."):
        assert said in html
    assert "run/augmented.yaml" in html


def test_a_named_effect_that_another_could_be_has_its_probability_in_the_headline():
    assert "lacks coulomb friction (or viscous friction)." in headline_text(NAMED)
    doubtful = replace(NAMED, effects=(replace(FRICTION, probability=0.64),))
    assert "lacks coulomb friction (or viscous friction) (64%)." in headline_text(doubtful)


def test_the_page_does_not_offer_a_simulation_that_held_out_rollouts_contradict(tmp_path):
    html = page(tmp_path, replace(NAMED, contradicted=True))
    assert "any stage takes it as" not in html
    assert "with what was named, refitted with their tolerances" not in html
    assert "with what was named, refitted with their tolerances" in page(tmp_path, NAMED)
    assert "any stage takes it as" in page(tmp_path, NAMED)


def test_held_out_rollouts_contradict_or_confirm_a_fit_or_could_not_be_made():
    """What is worse than the refitted data sheet alone is no finding, and what remains is what that one leaves."""
    worse = (Gap("tilt", 0.15, 0.10, 0.06, 0.14, 0.02, -0.5, 0.02, 9.0),)
    found = Findings(
        **dict.fromkeys(field.name for field in fields(Findings))
        | {"verdict": Verdict.NAMED, "added": ("coulomb_friction",), "data_sheet": (), "effects": (FRICTION,)}
    )
    told, left = _reviewed(replace(NAMED, gap=worse), found)
    assert (told.verdict, told.contradicted, left.added) == (Verdict.UNKNOWN, True, ())
    assert told.remaining.share == pytest.approx((0.06 - 0.02) / (0.10 - 0.02))
    told, left = _reviewed(NAMED, found)
    assert (told, left) == (NAMED, found)
    told, _ = _reviewed(replace(NAMED, gap=()), found)
    assert told.verdict is Verdict.NAMED
    assert told.advice[0] == UNCONFIRMED


def test_the_page_gives_the_suggested_command_and_what_to_do_by_hand_where_it_would_not_decide(tmp_path):
    command = "twbal real-rollout experiment=excite policy.prbs=0.18"
    found = NextExperiment({"policy.prbs": 0.18}, 10.0, 25.0, 1.5, (("coulomb_friction",), ()), 2, command)
    html = page(tmp_path, replace(NAMED, next_experiment=found))
    assert command in html
    assert "Drive at several speeds." not in html
    html = page(tmp_path, replace(NAMED, next_experiment=found._replace(separation=0.5)))
    assert "Drive at several speeds." in html


def test_the_json_has_the_suggested_command_and_the_recordings_that_disagree(tmp_path):
    found = NextExperiment({"steps": 500}, 10.0, 25.0, 1.5, ((),), 2, "twbal real-rollout steps=500")
    odd = Disagreement("b", ("a",), "torque_gain.gain", 0.9, -0.2, 0.02, "", 1e-4)
    write_diagnosis(tmp_path / "a.json", replace(NAMED, next_experiment=found, disagreements=(odd,)))
    record = json.loads((tmp_path / "a.json").read_text())
    assert record["next_experiment"]["settings"] == {"steps": 500}
    assert record["disagreements"][0]["recording"] == "b"
    assert concluded(tmp_path / "a.json").suggested == "twbal real-rollout steps=500"
    write_diagnosis(tmp_path / "b.json", NAMED)
    assert json.loads((tmp_path / "b.json").read_text())["next_experiment"] is None
    assert concluded(tmp_path / "b.json").suggested == ""


def test_the_page_and_the_json_have_the_curve_of_what_remains_and_what_it_looks_like(tmp_path):
    curve = FreeForm(
        "force at the axle", "N", "speed", "m/s", 40.0, 0.014, 0.3, ("rolling_viscous",), (), "it falls throughout",
        (-1.0, 0.0, 1.0), (5.0, 0.0, -5.0), (4.0, -1.0, -6.0), (6.0, 1.0, -4.0),
    )  # fmt: skip
    unknown = replace(NAMED, verdict=Verdict.UNKNOWN, free_form=(curve,))
    html = page(tmp_path, unknown, PICTURES | {"free_form": svg(free_form_figure(curve))})
    for said in ("over one variable", "in place of rolling viscous", "it falls throughout"):
        assert said in html
    assert "over one variable" not in page(tmp_path, NAMED)
    assert "It lies between -5 and 5 N for a speed from -1 to 1 m/s." in curve.text
    write_diagnosis(tmp_path / "diagnosis.json", unknown)
    (kept,) = json.loads((tmp_path / "diagnosis.json").read_text())["free_form"]
    assert kept["mean"] == [5.0, 0.0, -5.0]
    assert kept["in_place_of"] == ["rolling_viscous"]
    write_diagnosis(tmp_path / "diagnosis.json", NAMED)
    assert json.loads((tmp_path / "diagnosis.json").read_text())["free_form"] == []


def test_the_page_trusts_no_text(tmp_path):
    html = page(tmp_path, NAMED)
    assert "&lt;hides&gt;" in html
    assert "&lt;b&gt;sim&lt;/b&gt;" in html
    assert "<hides>" not in html


def test_sizes_and_probabilities_are_a_line_for_each_effect_that_is_named_or_likely():
    likely = replace(FRICTION, name="dead_zone", is_named=False, probability=0.6)
    unlikely = replace(FRICTION, name="motor_lag", is_named=False, probability=0.2)
    assert effect_lines(replace(NAMED, effects=(FRICTION, likely, unlikely))) == [
        "coulomb friction: torque 0.31 N·m (0.27 to 0.35) (95 %), probability 0.97",
        "dead zone: torque 0.31 N·m (0.27 to 0.35) (95 %), probability 0.60",
        "(Intervals are 2 times as wide as the fit alone makes them: held-out rollouts are so many times as far off "
        "as the sensors' noise alone would make them.)",
    ]
    near = tuple(gap._replace(after=1.03 * gap.noise_floor) for gap in NAMED.gap)
    assert len(effect_lines(replace(NAMED, effects=(FRICTION,), gap=near))) == 1
    assert effect_lines(replace(NAMED, effects=(unlikely,))) == []


def test_the_page_and_the_json_say_by_how_much_intervals_are_widened(tmp_path):
    said = "times as wide as the standard errors of the fit make them"
    assert f"Intervals are 2 {said}" in page(tmp_path, NAMED)
    near = replace(NAMED, gap=tuple(gap._replace(after=gap.noise_floor) for gap in NAMED.gap))
    assert said not in page(tmp_path, near)
    for diagnosis, scale in ((NAMED, 2.0), (near, 1.0)):
        write_diagnosis(tmp_path / "diagnosis.json", diagnosis)
        assert json.loads((tmp_path / "diagnosis.json").read_text())["gap"]["interval_scale"] == scale


@pytest.mark.parametrize("parameter_floor", [0.0, 0.002])
def test_the_page_says_as_the_console_does_what_intervals_are_measured_by(parameter_floor, tmp_path):
    gap = tuple(gap._replace(parameter_floor=parameter_floor) for gap in NAMED.gap)
    diagnosis = replace(NAMED, gap=gap)
    words = f"so many times as far off as {diagnosis.headline.expected_by} would make them."
    html = " ".join(page(tmp_path, diagnosis).replace("&#39;", "'").split())
    assert words in html
    assert words.rstrip(".") in effect_lines(diagnosis)[-1]
    assert ("leave open" in html) == (parameter_floor > 0.0)


@pytest.mark.parametrize("verdict", list(Verdict))
def test_every_verdict_has_a_sentence(verdict):
    sentence = headline_text(replace(NAMED, verdict=verdict, data_sheet_class=("gain, mass and inertia",)))
    assert sentence.endswith(".")


def headline_of(before, refitted, after, floor, verdict=Verdict.NAMED, **changes):
    """The headline with this error over 0.15 s."""
    least = min(floor, after)
    error = Gap("tilt", 0.15, before, refitted, after, least, (before - after) / (before - least), floor, 3.0)
    return headline_text(replace(NAMED, verdict=verdict, gap=(error,), **changes))


def test_the_headline_names_effect_and_equivalents_and_credits_each_with_its_share_of_the_gap():
    said = headline_text(NAMED)
    assert "coulomb friction (or viscous friction)" in said
    assert "Refitting the nominal parameters closes 50 % of the gap; coulomb friction closes another 25 %." in said
    assert (
        "0.02 rad of tilt after 0.15 s as the data sheet says, 0.012 rad refitted, 0.008 rad with what was named"
        in said
    )


@pytest.mark.parametrize(
    ("errors", "said"),
    [
        ((0.020, 0.0176, 0.0135, 0.004), "Named, not closed. Refitting the nominal parameters closes 15 % of the gap"),
        (
            (0.020, 0.010, 0.003, 0.004),
            "closes 62 % of the gap; coulomb friction closes the rest, down to the sensors' noise",
        ),
        (
            (0.020, 0.022, 0.008, 0.004),
            "alone closes nothing of the gap; with coulomb friction added, 75 % of it is closed",
        ),
        ((0.020, 0.006, 0.0061, 0.004), "coulomb friction closes no more of it"),
        ((0.015, 0.012, 0.005, 0.02), "too near to the sensors' noise"),
    ],
)
def test_the_headline_claims_no_share_that_the_rollouts_do_not_show(errors, said):
    text = headline_of(*errors)
    assert said in text
    assert "100 %" not in text
    assert f"noise alone would make that {errors[-1]:.3g} rad." in text


def test_the_headline_of_a_data_sheet_that_is_off_says_by_how_much_and_what_is_left():
    changes = {"data_sheet_class": ("gain, mass and inertia",), "effects": (), "verdict": Verdict.DATA_SHEET}
    explained = headline_of(0.02, 0.005, 0.005, 0.004, **changes)
    assert explained.startswith(
        "No effect is missing, but the data sheet is off: gain, mass and inertia (body mass x 1.02"
    )
    left = headline_of(0.2, 0.05, 0.05, 0.004, **changes)
    assert "No effect is missing" not in left
    assert "That does not explain all. Held-out rollouts are off by 0.2 rad" in left


def test_the_headline_says_that_an_effect_of_the_simulation_is_off():
    shift = Shift("viscous_friction coefficient", GIVEN_EFFECTS, 1.33, 3.3)
    changes = {"data_sheet_class": (GIVEN_EFFECTS,), "data_sheet": (shift,), "effects": ()}
    text = headline_of(0.02, 0.005, 0.005, 0.004, verdict=Verdict.DATA_SHEET, **changes)
    said = "what the simulation has is off: effects that the simulation has (viscous friction coefficient x 1.33"
    assert text.startswith(f"No effect is missing, but {said} (+3.3 tolerances)).")


def test_where_nothing_is_missing_the_headline_says_whether_that_takes_a_refit():
    changes = {"effects": (), "verdict": Verdict.NONE}
    assert headline_of(0.005, 0.005, 0.005, 0.004, **changes).startswith("The simulation explains these data")
    refitted = headline_of(0.02, 0.005, 0.005, 0.004, **changes)
    assert refitted.startswith("With its nominal parameters refitted within their tolerances")
    assert "0.02 rad of tilt" in refitted


def test_the_page_gives_units_and_keeps_the_share_of_the_refit_apart(tmp_path):
    html = page(tmp_path, NAMED)
    assert "<td>tilt [rad]</td>" in html
    assert "closed by refitting" in html
    assert "<td>50\u00a0%</td><td>25\u00a0%</td>" in html


@pytest.mark.parametrize(
    ("region", "said"),
    [
        (("speed", 0.5, 1.0), "for speed 0.5 to 1.0 m/s (3.2 times the error that the fit expects)"),
        (("tilt", 0.00123, 0.0345), "for tilt 0.1 to 2.0° (3.2"),
        (("tilt", -1e-7, 2e-6), "for tilt 0.00 to 0.00° (3.2"),
        (("command", -0.0163, -0.0065), "for command -0.016 to -0.006 N·m (3.2"),
        (("direction", -1.0, 0.0), "for wheels that turn back (3.2"),
    ],
)
def test_the_page_says_with_units_where_the_best_guess_is_most_wrong(tmp_path, region, said):
    axis, low, high = region
    worst = Region("wheel_rate", axis, low, high, 40, 0.3, 3.2)
    assert said in page(tmp_path, replace(NAMED, remaining=Remaining(0.25, True, (worst,))))


def test_the_page_says_why_sets_and_effects_have_other_probabilities(tmp_path):
    html = page(tmp_path, NAMED)
    for said in ("compare sets with each other", "need not be\n  the likeliest", "in the table above", "objections"):
        assert said in html
    assert "in the table above" not in page(tmp_path, NOTHING)


def test_the_page_says_which_number_of_the_map_is_agreement(tmp_path):
    html = page(tmp_path, NAMED)
    assert "starts from the motion that\nthe simulation with what was named sees" in html
    assert "1 means that simulation and measurement agree there" in html


def test_wheels_in_the_air_are_judged_by_how_far_they_turn():
    wheels = tuple(each._replace(channel="wheel_angle") for each in NAMED.gap)
    assert replace(NAMED, gap=wheels).headline == wheels[1]
    assert replace(NAMED, gap=(*wheels, *NAMED.gap)).headline == NAMED.gap[1]
