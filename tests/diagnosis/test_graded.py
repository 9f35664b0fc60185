"""Graded answers: how likely each effect is, its share of the gap, and what remains, whatever the verdict."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate
from synthetic_recordings import synthetic_recording

from twbal.cli.composition import composing
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.diagnosis import pipeline
from twbal.diagnosis.calibration import Objected, calibration
from twbal.diagnosis.candidates import Candidate, CandidateParameter
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.free_form_record import FreeForm
from twbal.diagnosis.graded import beside_function, contradicted, widened, with_shares
from twbal.diagnosis.inputs import DataSettings, DiagnosedSimulation, NamedEpisodes
from twbal.diagnosis.name import name_effects
from twbal.diagnosis.objections import Objection
from twbal.diagnosis.pipeline import diagnose_episodes
from twbal.diagnosis.probable import _is_of_its_own, chance_of_size, objected_to, probability_of
from twbal.diagnosis.record import Diagnosis, Estimate, Gap, ProbableEffect, Remaining, Verdict

FRICTION = {"coulomb_friction": {"torque": 0.3}}
EFFECT = ProbableEffect("dead_zone", 0.95, True, {}, (), "")


def settings(*words):
    with composing():
        return instantiate(compose("diagnose", ["episodes=e", *words]).diagnosis)


def shaken(recording, seed, size=0.15, seconds=0.5):
    """The recording with a gyro whose bias walks, which no effect of the library does (a Gauss-Markov process)."""
    rng = np.random.default_rng(seed)
    keep = np.exp(-recording.period / seconds)
    bias = np.zeros(len(recording) + 1)
    for n in range(1, len(bias)):
        bias[n] = keep * bias[n - 1] + size * np.sqrt(1.0 - keep**2) * rng.standard_normal()
    return replace(recording, measured=recording.measured + np.outer(bias, np.eye(4)[1]))


def test_an_effect_has_the_weight_of_all_sets_that_hold_it_or_its_equal():
    weights = {("a",): 0.5, ("a", "b"): 0.2, ("c",): 0.2, (): 0.1}
    a, b = (Candidate(name, (), same_as, (), "") for name, same_as in (("a", ()), ("b", ("c",))))
    assert probability_of(a, weights) == pytest.approx(0.7)
    assert probability_of(b, weights) == pytest.approx(0.4)


def test_what_takes_an_effects_place_counts_only_beside_the_rest_of_the_best_set():
    """A dead zone does as well as a delay beside a friction; alone, it does the friction's work."""
    friction, delay = (Candidate(name, (), (), (), "") for name in ("friction", "delay"))
    weights = {("delay", "friction"): 0.1, ("dead_zone", "friction"): 0.1, ("dead_zone", "filter"): 0.8}
    best = ("delay", "friction")
    assert probability_of(delay, weights, ["dead_zone"], best) == pytest.approx(0.2)
    assert probability_of(friction, weights, [], best) == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("weights", "expected"),
    [
        ({("delay", "friction"): 0.5, ("dead_zone", "friction"): 0.4, ("dead_zone", "filter"): 0.1}, False),
        ({("delay", "friction"): 0.2, ("dead_zone", "friction"): 0.1, ("dead_zone", "filter"): 0.7}, True),
        ({("dead_zone", "delay", "friction"): 0.6, ("dead_zone", "friction"): 0.3, ("filter",): 0.1}, True),
    ],
    ids=["in the place of the delay", "elsewhere", "beside the delay"],
)
def test_an_equivalent_that_mostly_does_something_else_is_listed_of_its_own(weights, expected):
    delay = Candidate("delay", (), (), (), "")
    chosen = SimpleNamespace(names=("delay", "friction"))
    assert _is_of_its_own("dead_zone", delay, chosen, weights) is expected


@pytest.mark.parametrize(
    ("effect", "objected", "expected"),
    [
        ("a", (), Objected.NOTHING),
        ("a", (Objection("not a", ("a",)), Objection("nothing", ())), Objected.EFFECT),
        ("b", (Objection("nothing"),), Objected.OTHERS),
        ("b", (Objection("not a", ("a",)),), Objected.OTHERS),
        ("b", (Objection("weights", ("a",), is_of_weights=True),), Objected.NOTHING),
    ],
)
def test_what_speaks_against_an_effect_counts_more_than_what_speaks_against_its_set(effect, objected, expected):
    assert objected_to(effect, objected) is expected


@pytest.mark.parametrize("neutral", [0.0, 1.0])
@pytest.mark.parametrize(("value", "error"), [(0.0, 0.02), (0.05, 0.02), (-0.04, 0.03), (0.5, 0.1), (0.01, 0.001)])
def test_an_effect_is_larger_than_a_trifle_with_the_share_of_what_it_may_be_that_is(neutral, value, error):
    size = CandidateParameter("size", "", -3.0, 3.0, neutral - 2.0, neutral)  # usual size 2: a trifle is at most 0.04
    found = {"size": Estimate(neutral + value, neutral + value - 1.96 * error, neutral + value + 1.96 * error, "")}
    drawn = np.random.default_rng(3).normal(value, error, 100_000)
    chance = chance_of_size(Candidate("any", (size,), (), (), ""), found, 0.02)
    assert chance == pytest.approx(np.mean(np.abs(drawn) > 0.04), abs=0.005)


def test_of_several_sizes_the_larger_one_counts():
    sizes = (CandidateParameter("a", "", 0.0, 3.0, 1.0, 0.0), CandidateParameter("b", "", 0.0, 3.0, 1.0, 0.0))
    found = {"a": Estimate(0.0, -0.001, 0.001, ""), "b": Estimate(0.5, 0.4, 0.6, "")}
    assert chance_of_size(Candidate("any", sizes, (), (), ""), found, 0.02) == pytest.approx(1.0)


def test_rollouts_that_get_worse_leave_nothing_named_and_no_share():
    (found,) = contradicted([replace(EFFECT, share=0.7, uncalibrated=0.95)], "worse")
    assert not found.is_named
    assert found.probability == calibration().corrected(0.95, Objected.OTHERS)
    assert (found.share, found.objections) == (None, ("worse",))


def test_shares_of_the_gap_are_not_clipped():
    head = Gap("tilt", 0.15, 0.05, 0.04, 0.012, 0.01, 0.95, 0.01, -3.0)
    (found,) = with_shares([EFFECT], head, {"dead_zone": 0.092})
    assert found.share == pytest.approx((0.092 - 0.012) / (0.05 - 0.01))
    assert head.remaining == pytest.approx((0.012 - 0.01) / (0.05 - 0.01))
    (flat,) = with_shares([EFFECT], head._replace(before=0.0105), {"dead_zone": 0.092})
    assert flat.share is None


def test_an_effect_without_which_the_model_cannot_follow_the_data_has_no_share():
    head = Gap("tilt", 0.15, 0.05, 0.04, 0.012, 0.01, 0.95, 0.01, -3.0)
    (found,) = with_shares([EFFECT], head, {"dead_zone": math.inf})
    assert found.share is None and found.is_named


@pytest.fixture(scope="module")
def part_explained(paper):
    """Coulomb friction, and a gyro that nothing in the library explains."""
    recording = shaken(synthetic_recording(paper, FRICTION, seed=61, periods=1200), 61)
    return name_effects([recording], paper, {}, candidates_for(paper), settings())


@pytest.mark.parametrize(
    ("after", "noise_floor", "channel", "scale"),
    [(0.02, 0.01, "tilt", 2.0), (0.009, 0.01, "tilt", 1.0), (0.02, 0.01, "wheel_angle", 1.0), (0.02, 0.0, "tilt", 1.0)],
)
def test_intervals_are_as_wide_as_rollouts_on_held_out_data_ask_for(after, noise_floor, channel, scale):
    head = Gap(channel, 0.15, 0.1, 0.1, after, min(after, noise_floor), 0.9, noise_floor, -3.0)
    effect = replace(EFFECT, parameters={"width": Estimate(0.5, 0.4, 0.7, "N·m")})
    (found,) = widened([effect], head)
    low, high = 0.5 - 0.1 * scale, 0.5 + 0.2 * scale
    assert found.parameters["width"][:3] == pytest.approx((0.5, low, high))
    assert widened([effect], None) == (effect,)


def test_intervals_have_nothing_that_no_robot_can_have():
    """No delay is negative; an angle may be."""
    sizes = {"delay": Estimate(0.003, -0.001, 0.007, "s")}, {"angle": Estimate(0.01, -0.02, 0.04, "rad")}
    late, leaning = (
        replace(EFFECT, name=name, parameters=each)
        for name, each in zip(("actuation_delay", "com_offset"), sizes, strict=True)
    )
    found = widened([late, leaning], None)
    assert found[0].parameters["delay"][:3] == (0.003, 0.0, 0.007)
    assert found[1].parameters["angle"][:3] == pytest.approx((0.01, -0.02, 0.04))


@pytest.mark.slow
def test_a_finding_is_not_lost_where_not_all_is_explained(part_explained):
    assert part_explained.verdict is Verdict.UNKNOWN
    (friction,) = (e for e in part_explained.effects if "coulomb_friction" in (e.name, *e.equivalents))
    assert not friction.is_named
    assert 0.5 <= friction.probability < 0.9
    assert friction.objections
    assert "coulomb_friction" in part_explained.named.effects
    estimate = friction.parameters["torque"]
    assert estimate.low95 < 0.3 < estimate.high95


def episodes_of(recording):
    """A recording as an episode, in two halves."""
    columns = np.zeros((len(recording) + 1, 7))
    columns[:, 0] = recording.period * np.arange(len(columns))
    columns[:, [1, 2, 4, 5]] = recording.measured
    half, found = len(recording) // 2, []
    for begin, end in ((0, half), (half, len(recording))):
        seen = columns[begin : end + 1] - columns[begin, 0] * np.eye(7)[0]
        source = Provenance("test", "robot", seed=0, trial=begin)
        commands = recording.commands[begin:end]
        found.append(Episode(("tilt",), recording.period, seen, seen[:, 1:2], commands, Outcome.COMPLETED, source))
    return found


DATA = DataSettings(
    horizons=[0.15],
    held_out=0.25,
    starts=20,
    bins=4,
    min_length=50,
    min_samples=300,
    max_yaw_rate=1.5,
    max_tilt=0.7,
    next_experiment=True,
    free_form=True,
)


def test_what_was_found_is_not_lost_where_a_later_step_ends_with_an_error(paper, monkeypatch):
    def singular(*_):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(pipeline, "disagreements", singular)
    measured = NamedEpisodes(episodes_of(synthetic_recording(paper, FRICTION, seed=62, periods=600)), ["one", "two"])
    hurried = replace(settings(), shortlist=2, max_effects=1)
    found = diagnose_episodes(
        measured, NamedEpisodes([], []), DiagnosedSimulation(paper, {}, 0.001), hurried, DATA
    ).diagnosis
    assert [effect.name for effect in found.named_effects] == ["coulomb_friction"]
    assert any("LinAlgError: Singular matrix" in said and "all else stands" in said for said in found.advice)


@pytest.mark.slow
def test_what_remains_is_said_beside_what_was_found(paper, monkeypatch):
    """The walking gyro remains; a robot with friction alone leaves nothing, and friction has nearly all of the gap."""
    results, asked = [], []
    monkeypatch.setattr(pipeline, "widened", lambda effects, head: (asked.append(head), widened(effects, head))[1])
    for recording in (
        synthetic_recording(paper, FRICTION, seed=62, periods=1200),
        shaken(synthetic_recording(paper, FRICTION, seed=62, periods=1200), 63),
    ):
        measured = NamedEpisodes(episodes_of(recording), ["one", "two"])
        simulation = DiagnosedSimulation(paper, {}, 0.001)
        results.append(diagnose_episodes(measured, NamedEpisodes([], []), simulation, settings(), DATA).diagnosis)
    plain, walking = results
    assert asked == [plain.headline, walking.headline]  # by which intervals are widened
    assert [effect.name for effect in plain.named_effects] == ["coulomb_friction"]
    assert plain.effects[0].share == pytest.approx(1.0, abs=0.3)
    assert plain.remaining.share == pytest.approx(0.0, abs=0.2)
    assert not plain.remaining.is_beyond_noise
    assert walking.remaining.is_beyond_noise
    assert walking.remaining.where[0].channel == "tilt_rate"
    assert min(region.rms for region in plain.where if region.channel == "tilt") == pytest.approx(1.0, abs=0.3)


def test_short_control_periods_take_fewer_physics_steps():
    usual = settings()
    assert [usual.for_period(period).substeps for period in (0.03, 0.02, 0.01, 0.005)] == [10, 10, 5, 3]


def found_function(*in_place_of):
    """A force at the axle over the speed that explains a tenth of the errors."""
    numbers = (20.0, 0.01, 0.1, in_place_of, (), "it falls throughout")
    return FreeForm("force at the axle", "N", "speed", "m/s", *numbers, *((0.0, 1.0),) * 4)


def without_remains(verdict, *names):
    """A diagnosis of named effects that leaves nothing."""
    effects = [ProbableEffect(name, 0.98, True, {}, (), "", uncalibrated=1.0) for name in names]
    remaining = Remaining(0.0, False, ())
    return Diagnosis(verdict, tuple(effects), remaining, names, (), (), (), (), (), (), (), {}, ())


def test_effects_that_a_function_replaces_are_no_longer_named_and_something_remains():
    before = without_remains(Verdict.NAMED, "rolling_viscous", "dead_zone")
    after = beside_function(before, found_function("rolling_viscous"))
    assert after.has_remains and not before.has_remains
    assert after.verdict is Verdict.NAMED
    assert [effect.name for effect in after.effects] == ["dead_zone", "rolling_viscous"]
    zone, rolling = after.effects
    assert zone == before.effects[1]
    assert not rolling.is_named and rolling.objected is Objected.EFFECT
    assert rolling.probability == calibration().corrected(1.0, Objected.EFFECT) < 0.5
    assert "as a function of the speed does as well in its place" in rolling.objections[-1]


@pytest.mark.parametrize(("verdict", "names"), [(Verdict.NAMED, ["rolling_viscous"]), (Verdict.NONE, [])])
def test_where_a_function_leaves_nothing_named_the_verdict_is_unknown(verdict, names):
    after = beside_function(without_remains(verdict, *names), found_function(*names))
    assert after.verdict is Verdict.UNKNOWN and after.has_remains


def test_a_function_on_top_of_all_effects_leaves_them_as_they_are():
    before = without_remains(Verdict.NAMED, "dead_zone")
    after = beside_function(before, found_function())
    assert after == replace(before, remaining=Remaining(0.0, True, ()))


@pytest.mark.slow
def test_a_drag_that_the_library_lacks_is_no_rolling_friction(paper):
    """Without `quadratic_drag`, a rolling friction does most of its work; a function of the speed does more."""
    drag = {"quadratic_drag": {"coefficient": 8.0}}
    episodes = [each for seed in (1, 2, 3) for each in episodes_of(synthetic_recording(paper, drag, seed))]
    measured = NamedEpisodes(episodes, [f"run{i}" for i in range(len(episodes))])
    few = settings("diagnosis.max_effects=3", "diagnosis.tempered_search=false", "diagnosis.exclude=[quadratic_drag]")
    simulation = DiagnosedSimulation(paper, {}, 0.001)
    found = diagnose_episodes(measured, NamedEpisodes([], []), simulation, few, replace(DATA, free_form=True)).diagnosis
    assert found.has_remains
    assert (found.free_form[0].quantity, found.free_form[0].variable) == ("force at the axle", "speed")
    assert not any(effect.name.startswith("rolling") for effect in found.named_effects)
