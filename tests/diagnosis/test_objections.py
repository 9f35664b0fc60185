"""What is no finding is not named, told by fits with given values."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_settings import LEAST_SCORES
from hydra import compose
from hydra.utils import instantiate
from synthetic_recordings import synthetic_recording

from twbal.cli.composition import composing
from twbal.diagnosis import name
from twbal.diagnosis.advice import advise
from twbal.diagnosis.calibration import Objected, calibration
from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.hypothesis import FittedHypothesis, Round, fit_hypothesis, overriding
from twbal.diagnosis.name import extent_of, first_noise, largest_noise
from twbal.diagnosis.objections import Extent, Objection, is_doubtful, objections
from twbal.diagnosis.probable import estimates, objected_to, probable_effects
from twbal.diagnosis.problem import Problem, Selection
from twbal.diagnosis.record import Gap, ProbableEffect, Verdict
from twbal.diagnosis.verdict import conclude, probabilities, review
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import ANGLE_LEAD, Data, Model
from twbal.sysid.noise import LASTING
from twbal.sysid.prediction_error_fit import Fit
from twbal.sysid.recording import Recording

INSTANTS = 1000


ROUGH = "diagnosis.tolerances.data_sheet=0.15"


def settings(*words):
    with composing():
        found = instantiate(compose("diagnose", ["episodes=e", *words]).diagnosis)
    return replace(found, least_scores=LEAST_SCORES)


def fitted(robot, names, values, total=0.0, words=(), given=None):
    """A set of effects as a fit with white residuals would leave it, with these values."""
    planar = planar_parameters(robot, given or {})
    chosen = tuple(c for name in names for c in candidates_for(robot) if c.name == name)
    model = Model(planar, 0.0, first_noise(robot, np.ones(4, bool))).put(values)
    free_parameters = (
        *always_free(
            settings(*words).tolerances, planar, 1, given=[c for c in candidates_for(robot) if c.name in (given or {})]
        ),
        *(free for c in chosen for free in c.free_parameters),
    )
    return FittedHypothesis(chosen, Fit(model, free_parameters, total, None, np.zeros(4 * INSTANTS)), np.ones(4), 0.0)


@pytest.fixture(scope="module")
def driven(paper):
    return [synthetic_recording(paper, {}, seed=51, periods=300)]


def test_nothing_speaks_against_an_effect_of_usual_size(paper, driven):
    hypothesis = fitted(paper, ["coulomb_friction"], {"coulomb_friction_torque": 0.3})
    assert objections(hypothesis, largest_noise(paper), (), settings()) == ()


@pytest.mark.parametrize(
    ("names", "factor", "doubtful"),
    [
        (["coulomb_friction"], 1.03, False),  # one tolerance off
        (["coulomb_friction"], 1.06, True),
        (["coulomb_friction", "com_height"], 1.06, False),  # and said to be off
    ],
)
def test_a_set_that_pulls_the_data_sheet_away_is_searched_for_another(names, factor, doubtful, paper):
    values = {"coulomb_friction_torque": 0.3, "com_height_factor": factor}
    hypothesis = fitted(paper, names, values)
    assert is_doubtful(hypothesis, settings()) is doubtful
    assert objections(hypothesis, largest_noise(paper), (), settings()) == ()  # it may be named all the same


@pytest.mark.parametrize(("coefficient", "said"), [(0.021, 0), (0.024, 0), (0.03, 2)])
def test_what_the_simulation_has_is_no_finding_if_it_is_far_off(coefficient, said, paper):
    values = {"coulomb_friction_torque": 0.3, "viscous_friction_coefficient": coefficient}
    hypothesis = fitted(paper, ["coulomb_friction"], values, given={"viscous_friction": {"coefficient": 0.02}})
    assert is_doubtful(hypothesis, settings()) is (coefficient > 0.021)
    found = [objection.text for objection in objections(hypothesis, largest_noise(paper), (), settings())]
    assert len(found) == said
    if said:
        assert "a viscous friction coefficient of 1.5 times the simulation's, 5 tolerances off" in found[0]
        assert "diagnosis.tolerances.effects=0.5" in found[1]


@pytest.mark.parametrize(("lead", "doubtful"), [(0.0005, False), (0.0015, True), (-0.0015, True)])
def test_angles_that_are_read_early_may_stand_for_a_delay(lead, doubtful, paper):
    hypothesis = fitted(paper, ["coulomb_friction"], {"coulomb_friction_torque": 0.3, ANGLE_LEAD: lead})
    assert is_doubtful(hypothesis, settings()) is doubtful


def bounds(robot, field):
    """The range of a value of the data sheet."""
    free_parameters = always_free(settings().tolerances, planar_parameters(robot, {}), 1)
    return next((free.low, free.high) for free in free_parameters if free.field == field)


@pytest.mark.parametrize(
    ("fields", "end", "side"), [(("body_mass", "com_height"), 0, "lower"), (("wheel_radius",), 1, "upper")]
)
def test_a_rough_data_sheet_that_ran_to_its_bounds_is_no_finding(fields, end, side, paper, driven):
    """However many tolerances that is: with 15 % of tolerance a bound may come before the guard of 4.5 of them."""
    rough = settings(ROUGH)
    rough = replace(rough, thresholds=replace(rough.thresholds, max_shift=1e9))
    values = {f"{field}_factor": bounds(paper, f"{field}_factor")[end] for field in fields}
    hypothesis = fitted(paper, ["coulomb_friction"], {"coulomb_friction_torque": 0.3, **values}, words=(ROUGH,))
    found = objections(hypothesis, largest_noise(paper), (), rough)
    assert len(found) == len(fields)
    for field, factor in zip(fields, values.values(), strict=True):
        said = f"{field.replace('_', ' ')} of {factor:.2g} times the data sheet's, the {side} bound of its range"
        assert said in " ".join(objection.text for objection in found)
    assert conclude(Selection(hypothesis, (), hypothesis), found, 0.0, (), rough) is Verdict.UNKNOWN


def test_a_wheel_that_ran_to_its_bound_is_no_finding(paper, driven):
    highest = bounds(paper, "wheel_inertia")[1]
    hypothesis = fitted(paper, ["coulomb_friction"], {"coulomb_friction_torque": 0.3, "wheel_inertia": highest})
    found, rough = objections(hypothesis, largest_noise(paper), (), settings())
    assert "wheel inertia of" in found.text
    assert "the upper bound" in found.text
    assert ROUGH in rough.text


@pytest.mark.parametrize(("limit", "objected"), [(0.0335, True), (5.0, False)])
def test_a_limit_that_swallows_the_commands_explains_nothing(limit, objected, paper, driven):
    hypothesis = fitted(paper, ["torque_saturation"], {"torque_saturation_limit": limit})
    swallowing = overriding(Data(driven, 10), hypothesis.fit.model, hypothesis.candidates)
    found = objections(hypothesis._replace(overriding=swallowing), largest_noise(paper), (), settings())
    said = [objection.text for objection in found if "commands" in objection.text]
    assert bool(said) is objected
    assert not said or "torque saturation of 0.0335 N·m, lets next to nothing of the commands pass" in said[0]


@pytest.mark.parametrize(("name", "field"), [("motor_lag", "time_constant"), ("com_offset", "angle")])
def test_an_effect_of_size_zero_is_no_finding(name, field, paper, driven):
    (found,) = objections(fitted(paper, [name], {f"{name}_{field}": 1e-5}), largest_noise(paper), (), settings())
    assert "negligible" in found.text
    assert "1e-05" in found.text
    assert found.effects == (name,)


@pytest.mark.parametrize(
    ("name", "values", "extent", "objected"),
    [
        ("periodic_disturbance", {"force": 1.2, "frequency": 0.1}, Extent(10.0, 9.0, 9.0), True),
        ("periodic_disturbance", {"force": 1.2, "frequency": 0.1}, Extent(40.0, 0.1, 0.1), False),
        ("ground_waves", {"slope": 0.02, "waves": 0.5}, Extent(90.0, 1.5, 9.0), True),
        ("ground_waves", {"slope": 0.02, "waves": 0.5}, Extent(1.0, 2.5, 0.1), False),
        ("cogging", {"torque": 0.2, "count": 12.0}, Extent(90.0, 9.0, 0.05), True),
        ("cogging", {"torque": 0.2, "count": 12.0}, Extent(1.0, 0.1, 0.1), False),
    ],
)
def test_a_wave_of_which_no_recording_holds_enough_periods_is_no_finding(name, values, extent, objected, paper, driven):
    hypothesis = fitted(paper, [name], {f"{name}_{key}": value for key, value in values.items()})
    found = objections(hypothesis, largest_noise(paper), (), settings(), extent)
    assert [objection.effects for objection in found] == [(name,)] * objected
    assert not objected or "it cannot be told from any slow change" in found[0].text


@pytest.mark.parametrize(("falls", "objected"), [(9.0, True), (15.0, False)])
def test_effects_that_nothing_but_short_recordings_show_are_no_finding(falls, objected, paper, driven):
    extent = Extent(1.8, 1.0, 1.0, falls)
    hypothesis = fitted(paper, ["coulomb_friction"], {"coulomb_friction_torque": 0.5})
    found = objections(hypothesis, largest_noise(paper), (), settings(), extent)
    assert [objection.effects for objection in found] == [()] * objected
    assert not objected or "lasts 1.8 s, 9 times the time constant of a fall" in found[0].text
    assert not objections(fitted(paper, [], {}), largest_noise(paper), (), settings(), extent)


def test_the_extent_of_recordings_is_that_of_the_farthest(paper):
    """A robot that rolls half a metre upright, and one whose body turns about wheels that stand still."""
    t = np.linspace(0.0, 1.0, 101)
    rolls = np.stack([0.0 * t, 0.0 * t, 0.5 / paper.wheel_radius * t, 0.0 * t], axis=1)
    leans = np.stack([2.0 * t, 0.0 * t, -2.0 * t, 0.0 * t], axis=1)
    whole, none = np.ones(101, bool), np.zeros(101)
    rolling, leaning = (
        Recording("any", 0.01, none[1:], measured, none, whole, np.ones(4, bool)) for measured in (rolls, leans)
    )
    fall = np.sqrt((paper.body_inertia_pitch + 10.0 * 0.3**2) / (10.0 * 9.81 * 0.3))
    assert extent_of([leaning], paper) == pytest.approx((1.0, 0.0, 1.0 / np.pi, 1.0 / fall), abs=1e-12, rel=1e-3)
    assert extent_of([rolling, leaning.part(0, 50)], paper) == pytest.approx(
        (1.0, 0.5, 0.5 / (2.0 * np.pi * paper.wheel_radius), 1.0 / fall), rel=1e-3
    )


def test_residuals_with_memory_are_told_with_their_autocorrelation(paper, driven):
    hypothesis = fitted(paper, ["coulomb_friction"], {"coulomb_friction_torque": 0.3})._replace(
        autocorrelations=np.full(4, 12.0)
    )
    (found,) = objections(hypothesis, largest_noise(paper), (), settings())
    assert "autocorrelated: their Ljung-Box statistic is 12 times that of white noise; the limit is 8" in found.text
    assert found.concerns("any effect")


@pytest.mark.parametrize(("component", "said"), [(0, "at the joints"), (1, "from outside"), (2, "of the tilt")])
def test_a_model_discrepancy_that_explains_what_is_missing_is_told(component, said, paper):
    """Nothing is called missing only where a discrepancy stays as small as its prior has it."""
    nothing = fitted(paper, [], {})
    largest = largest_noise(paper)
    levels = np.zeros(LASTING)
    levels[component] = 0.9 * largest.discrepancy[component]
    model = nothing.fit.model._replace(noise=nothing.fit.model.noise._replace(discrepancy=levels))
    nothing = nothing._replace(fit=nothing.fit._replace(model=model))
    (found,) = objections(nothing, largest, (), settings())
    assert said in found.text
    assert conclude(Selection(nothing, (), nothing), [found], 0.0, (), settings()) is Verdict.UNKNOWN
    usual = model._replace(noise=model.noise._replace(discrepancy=levels / 3.0))
    assert objections(nothing._replace(fit=nothing.fit._replace(model=usual)), largest, (), settings()) == ()


def test_an_effect_that_a_fit_leaves_at_nothing_is_not_named_beside_another(paper):
    data = Data([synthetic_recording(paper, {"coulomb_friction": {"torque": 0.1}}, seed=52, periods=500)], 10)
    planar = planar_parameters(paper, {})
    start = data.with_noise(Model(planar, 0.0, first_noise(paper, data.sensed)), 30)
    pair = [c for c in candidates_for(paper) if c.name in ("coulomb_friction", "motor_lag")]
    hypothesis = fit_hypothesis(data, start, always_free(settings().tolerances, planar, 1), pair, 4)
    hypothesis = hypothesis._replace(
        fit=hypothesis.fit._replace(model=hypothesis.fit.model.put({"motor_lag_time_constant": 0.0}))
    )
    selection = Selection(hypothesis, (), hypothesis)
    weights = probabilities(selection, settings())
    found = probable_effects(data, selection, (), Verdict.NAMED, weights, settings())
    assert [effect.name for effect in found if effect.is_named] == ["coulomb_friction"]
    assert objections(hypothesis, largest_noise(paper), (), settings()) == ()


@pytest.mark.parametrize(("seconds", "objected"), [(1.0, Objected.EFFECT), (10.0, Objected.NOTHING)])
def test_a_slow_wave_is_as_unlikely_in_a_set_that_was_not_chosen(seconds, objected, paper):
    """Of less than two periods in a recording: any slow change looks like that."""
    hidden = {
        "coulomb_friction": {"torque": 0.1},
        "periodic_disturbance": {"force": 5.0, "frequency": 1.0, "phase": 0.0},
    }
    data = Data([synthetic_recording(paper, hidden, seed=52, periods=500)], 10)
    start = data.with_noise(Model(planar_parameters(paper, {}), 0.0, first_noise(paper, data.sensed)), 30)
    always = always_free(settings().tolerances, planar_parameters(paper, {}), 1)
    by_name = {candidate.name: candidate for candidate in candidates_for(paper)}
    friction, wave = by_name["coulomb_friction"], by_name["periodic_disturbance"]
    chosen = fit_hypothesis(data, start, always, [friction], 4)
    other = fit_hypothesis(data, start, always, [friction, wave], 4)
    true = {f"periodic_disturbance_{name}": value for name, value in hidden["periodic_disturbance"].items()}
    other = other._replace(fit=other.fit._replace(model=other.fit.model.put(true)))
    selection = Selection(chosen, (Round(chosen, [], [other]),), chosen)
    weights = {chosen.names: 0.2, other.names: 0.8}
    found = probable_effects(data, selection, (), Verdict.NAMED, weights, settings(), Extent(seconds, 1.0, 1.0))
    told = {effect.name: effect for effect in found}
    wave, friction = told["periodic_disturbance"], told["coulomb_friction"]
    assert wave.uncalibrated == pytest.approx(0.8, rel=0.05)
    assert wave.probability == calibration().corrected(wave.uncalibrated, objected)
    assert ("No recording holds" in " ".join(wave.objections)) == (objected is Objected.EFFECT)
    assert friction.uncalibrated == pytest.approx(1.0)


@pytest.mark.parametrize("names", [("coulomb_friction", "ground_waves"), ("ground_waves",)], ids=["others", "alone"])
def test_a_slow_wave_takes_nothing_from_the_effects_beside_it(names, paper):
    """Half a period does not tell that it is a wave. The friction of the wheels is as sure as without it."""
    waves = {"ground_waves_slope": 0.02, "ground_waves_waves": 0.5, "ground_waves_phase": 0.3}
    friction = {"coulomb_friction_torque": 0.3}
    chosen = fitted(paper, names, waves | (friction if len(names) > 1 else {}))
    found = objections(chosen, largest_noise(paper), (), settings(), Extent(100.0, 1.0, 10.0))
    assert [(o.effects, o.is_of_own) for o in found] == [(("ground_waves",), True)]
    verdict = conclude(Selection(chosen, (), chosen), found, 0.0, (), settings())
    assert verdict is (Verdict.NAMED if len(names) > 1 else Verdict.UNKNOWN)
    assert objected_to("ground_waves", found) is Objected.EFFECT
    assert objected_to("coulomb_friction", found) is Objected.NOTHING
    data = Data([synthetic_recording(paper, {}, seed=52, periods=300)], 10)
    kalman = data.filter(chosen.fit.model)
    chosen = chosen._replace(
        fit=chosen.fit._replace(kalman=kalman, white=data.white(chosen.fit.model, kalman)), bic_penalty=0.0
    )
    effects = probable_effects(data, Selection(chosen, (), chosen), found, verdict, {chosen.names: 1.0}, settings())
    assert {effect.name for effect in effects if effect.is_named} == set(names) - {"ground_waves"}


@pytest.mark.parametrize(("coefficient", "objected"), [(0.3, Objected.EFFECT), (0.05, Objected.NOTHING)])
def test_an_effect_at_its_bound_is_as_unlikely_in_a_set_that_was_not_chosen(coefficient, objected, paper):
    hidden = {"coulomb_friction": {"torque": 0.1}, "rolling_viscous": {"coefficient": 0.05}}
    data = Data([synthetic_recording(paper, hidden, seed=53, periods=300)], 10)
    start = data.with_noise(Model(planar_parameters(paper, {}), 0.0, first_noise(paper, data.sensed)), 30)
    always = always_free(settings().tolerances, planar_parameters(paper, {}), 1)
    by_name = {candidate.name: candidate for candidate in candidates_for(paper)}
    friction, drag = by_name["coulomb_friction"], by_name["rolling_viscous"]
    assert drag.parameters[0].high == 0.3
    chosen = fit_hypothesis(data, start, always, [friction], 4)
    other = fit_hypothesis(data, start, always, [friction, drag], 4)
    moved = other.fit.model.put({"rolling_viscous_coefficient": coefficient})
    other = other._replace(fit=other.fit._replace(model=moved))
    selection = Selection(chosen, (Round(chosen, [], [other]),), chosen)
    weights = {chosen.names: 0.2, other.names: 0.8}
    found = probable_effects(data, selection, (), Verdict.NAMED, weights, settings())
    told = {effect.name: effect for effect in found}
    drag = told["rolling_viscous"]
    assert drag.uncalibrated == pytest.approx(0.8, rel=0.05)
    assert drag.probability == calibration().corrected(drag.uncalibrated, objected)
    assert ("ran to a bound" in " ".join(drag.objections)) == (objected is Objected.EFFECT)


@pytest.mark.parametrize(
    ("effect", "parameter", "share"),
    [("backlash", "gap", 0.35), ("viscous_friction", "coefficient", 0.03), ("flexible_frame", "frequency", 0.03)],
)
def test_an_interval_is_as_wide_as_the_form_of_the_effect_is_unsure(effect, parameter, share, paper):
    """Of a frequency, too, at which the effect is not nothing: here it is that at which none is looked for at first."""
    values = {
        "backlash": {"gap": 0.02},
        "viscous_friction": {"coefficient": 0.05},
        "flexible_frame": {"share": 0.1, "frequency": 5.0, "damping": 0.05, "height": 1.8},
    }
    data = Data([synthetic_recording(paper, {effect: values[effect]}, seed=54, periods=1000)], 10)
    start = data.with_noise(Model(planar_parameters(paper, {}), 0.0, first_noise(paper, data.sensed)), 30)
    (candidate,) = (c for c in candidates_for(paper) if c.name == effect)
    always = always_free(settings().tolerances, planar_parameters(paper, {}), 1)
    near = start.put(
        {candidate.field(p): values[effect][p.name] for p in candidate.parameters if p.name in values[effect]}
    )
    found = fit_hypothesis(data, near, always, [candidate], 4)
    estimate = estimates(data, found, [candidate], settings())[effect][parameter]
    half = 0.5 * (estimate.high95 - estimate.low95) / estimate.value
    assert 1.96 * share <= half < 2.2 * share + 0.05


def advice_of(paper, *others):
    """Advice on Coulomb friction that was named, where these sets were hypothesis in the last round."""
    base = fitted(paper, [], {}, 1000.0)
    chosen = fitted(paper, ["coulomb_friction"], {"coulomb_friction_torque": 0.3}, 500.0)
    selection = Selection(base, (Round(base, [], [chosen]), Round(chosen, [], list(others))), chosen)
    return " ".join(advise(selection, (), 0.0, (), None, Verdict.NAMED, settings()))


def test_one_more_effect_is_asked_for_by_sets_with_one_more_alone(paper):
    sizes = {"coulomb_friction_torque": 0.3, "dead_zone_width": 1.0}
    same_size = fitted(paper, ["dead_zone"], {"dead_zone_width": 1.0}, 100.0)
    with_one_more = fitted(paper, ["dead_zone", "coulomb_friction"], sizes, 100.0)
    with_little_more = fitted(paper, ["coulomb_friction", "dead_zone"], sizes, 495.0)
    assert "one more effect" not in advice_of(paper, same_size)
    assert "one more effect" not in advice_of(paper, with_little_more)
    assert "one more effect" in advice_of(paper, same_size, with_one_more)


def test_values_of_the_data_sheet_that_are_off_are_listed_with_their_factors(paper):
    values = {"coulomb_friction_torque": 0.3, "body_mass_factor": 1.12, "com_height_factor": 0.95}
    chosen = fitted(paper, ["coulomb_friction"], values)
    selection = Selection(fitted(paper, [], {}, 500.0), (Round(chosen, [], []),), chosen)
    far = " ".join(advise(selection, (), 0.0, (), None, Verdict.NAMED, settings()))
    assert "tolerances of 3%: body mass x 1.12 (+4.0 tolerances)." in far
    near = chosen._replace(fit=chosen.fit._replace(model=chosen.fit.model.put({"body_mass_factor": 1.06})))
    exceeds_tolerances = " ".join(advise(selection._replace(chosen=near), (), 1e3, (), None, Verdict.NAMED, settings()))
    assert "body mass x 1.06 (+2.0 tolerances), com height x 0.95 (-1.7 tolerances)." in exceeds_tolerances


def gap(before, refitted, after, noise_floor, excess=3.0):
    """As `measure_gaps` makes it."""
    least = min(noise_floor, after)
    closed = (before - after) / (before - least) if before > 1.1 * least else None
    return Gap("tilt", 0.15, before, refitted, after, least, closed, noise_floor, excess)


@pytest.mark.parametrize(
    "error",
    [
        gap(0.020, 0.021, 0.022, 0.005),
        gap(0.140, 0.186, 1.357, 1.300),
        gap(0.020, 0.006, 0.009, 0.005),
    ],
    ids=["worse than before", "much worse than its own floor allows to tell", "worse than refitted"],
)
@pytest.mark.parametrize("verdict", [Verdict.NAMED, Verdict.UNKNOWN])
def test_what_makes_held_out_rollouts_worse_is_no_finding(error, verdict):
    found, sentence = review(verdict, ("backlash",), error)
    assert found is Verdict.UNKNOWN
    assert "WARNING" in sentence
    for number in (error.before, error.refitted, error.after):
        assert f"{number:.3g}" in sentence


@pytest.mark.parametrize(
    "error",
    [gap(0.020, 0.010, 0.006, 0.005), gap(0.020, 0.0060, 0.0061, 0.005), gap(0.020, 0.006, 0.009, 0.005, 1.5), None],
)
def test_what_makes_rollouts_better_or_no_worse_than_by_chance_stays_named(error):
    assert review(Verdict.NAMED, ("imu_delay",), error) == (Verdict.NAMED, "")


def test_no_simulation_explains_data_from_which_its_rollouts_stray():
    found, sentence = review(Verdict.NONE, (), gap(0.030, 0.025, 0.025, 0.005))
    assert found is Verdict.UNKNOWN
    assert "0.025 rad, 5 times what the sensors' noise" in sentence
    assert review(Verdict.NONE, (), gap(0.030, 0.007, 0.007, 0.005)) == (Verdict.NONE, "")
    in_the_air = gap(0.030, 0.025, 0.025, 0.005)._replace(channel="wheel_angle")
    assert review(Verdict.NONE, (), in_the_air) == (Verdict.NONE, "")


def test_of_a_set_that_something_speaks_against_the_likely_effects_enter_the_simulation(paper, monkeypatch):
    taken = []

    def without(problem, of, candidate):
        taken.append(candidate.name)
        return of._replace(candidates=tuple(each for each in of.candidates if each is not candidate))

    monkeypatch.setattr(name, "without", without)
    problem = Problem(None, None, (), (), settings())
    sizes = {"coulomb_friction_torque": 0.3, "motor_lag_time_constant": 0.0}
    both = fitted(paper, ["coulomb_friction", "motor_lag"], sizes)
    likely = [ProbableEffect("coulomb_friction", 0.8, False, {}, (), "")]
    assert name._guess(problem, both, likely, ()) is both  # the lag is negligible
    large = fitted(paper, ["coulomb_friction", "motor_lag"], {**sizes, "motor_lag_time_constant": 0.02})
    assert name._guess(problem, large, likely, ()).names == ("coulomb_friction",)
    assert taken == ["motor_lag"]
    short = Objection("The recordings are short.", is_of_length=True)
    assert name._guess(problem, large, likely, (short,)) is large
    assert name._guess(problem, large, likely, (short, Objection("Besides."))).names == ("coulomb_friction",)
    assert name._guess(problem, large, [], ()) is None
    only = fitted(paper, ["motor_lag"], {"motor_lag_time_constant": 0.0})
    assert name._guess(problem, only, likely, ()) is None
