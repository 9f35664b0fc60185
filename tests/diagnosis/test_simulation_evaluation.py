"""How well simulations predict logs: held against robots whose true simulation is known."""

from dataclasses import replace

import numpy as np
import pytest
from evaluated_logs import TRUE, WRONG, given, log, settings
from scipy.stats import binom
from synthetic_recordings import NOISE

from twbal.core.episode import Estimated, Provenance
from twbal.core.errors import ConfigError, DataError
from twbal.diagnosis.evaluation_record import ALL_LOGS
from twbal.diagnosis.simulation_evaluation import evaluate_simulations
from twbal.sysid.recording import MEASURED


@pytest.fixture(scope="module")
def evaluated(paper):
    logs = [log(paper, TRUE, seed) for seed in (1, 2)]
    simulations = [given("nominal", {}), given("true", TRUE, [logs[0].sha256]), given("wrong", WRONG)]
    return evaluate_simulations(simulations, logs, paper, settings())


def of(evaluated, simulation, log=ALL_LOGS, channel="tilt", horizon=0.2):
    return evaluated.score(simulation, log, channel, horizon)


@pytest.mark.parametrize("channel", MEASURED)
@pytest.mark.parametrize("horizon", [0.02, 0.1, 0.2])
def test_the_true_simulation_is_as_good_as_noise_allows_and_the_nominal_one_is_not(channel, horizon, evaluated):
    true, nominal = (of(evaluated, name, channel=channel, horizon=horizon) for name in ("true", "nominal"))
    assert true.error == pytest.approx(true.noise_floor, rel=0.25)
    assert nominal.ratio == 1.0
    if horizon > 0.05:  # earlier, what is missing has hardly moved the robot
        assert nominal.error > 1.3 * true.error
        assert true.is_better and not true.is_worse
        assert true.closed == pytest.approx(1.0, abs=0.15)
        assert nominal.closed == 0.0


def test_a_simulation_that_is_worse_closes_less_than_nothing(evaluated):
    for name in ("log 1", "log 2", ALL_LOGS):
        wrong = of(evaluated, "wrong", name)
        assert wrong.is_worse and not wrong.is_better
        assert wrong.ratio > 1.2
        assert wrong.closed < -0.2
        assert wrong.closed95.low95 < wrong.closed < wrong.closed95.high95 < 0.0


def test_right_after_the_start_the_error_is_the_noise_of_the_sensors(evaluated):
    for channel, sd in NOISE.items():
        assert 0.93 * sd < of(evaluated, "true", channel=channel, horizon=0.02).error < 1.8 * sd


def test_errors_of_both_logs_together_are_their_root_mean_square(evaluated):
    one, two, both = (of(evaluated, "nominal", name) for name in ("log 1", "log 2", ALL_LOGS))
    assert one.starts == two.starts
    assert both.starts == 2 * one.starts
    assert both.error**2 == pytest.approx((one.error**2 + two.error**2) / 2)


def test_a_simulation_is_marked_on_the_log_that_it_was_found_on(evaluated):
    assert of(evaluated, "true", "log 1").is_own_data
    assert not of(evaluated, "true", "log 2").is_own_data
    assert not of(evaluated, "nominal", "log 1").is_own_data
    assert evaluated.simulations[1].found_on == ("log 1",)


def test_what_one_simulation_says_does_not_depend_on_the_others(paper, evaluated):
    logs = [log(paper, TRUE, seed) for seed in (1, 2)]
    alone = evaluate_simulations([given("nominal", {}), given("wrong", WRONG)], logs, paper, settings())
    assert of(alone, "wrong") == of(evaluated, "wrong")


def test_intervals_hold_the_true_error_in_about_95_of_100_logs(paper):
    """Also of a simulation with another error than noise."""
    logs = [log(paper, TRUE, seed, periods=400) for seed in range(10, 34)]
    found = evaluate_simulations(
        [given("nominal", {}), given("true", TRUE)], logs, paper, settings(horizons=[0.1], min_block=0.5)
    )
    held, ratio_held, count = 0, 0, 0
    for simulation in ("nominal", "true"):
        for channel in MEASURED:
            whole = of(found, simulation, channel=channel, horizon=0.1)
            for each in logs:
                score = of(found, simulation, each.name, channel, 0.1)
                held += score.error95.low95 < whole.error < score.error95.high95
                ratio_held += score.ratio95.low95 <= whole.ratio <= score.ratio95.high95
                count += 1
    assert binom.ppf(0.001, count // 4, 0.93) <= held / 4  # channels of a log are no independent cases
    assert held <= 0.995 * count
    assert ratio_held >= 0.88 * count


def test_a_simulation_that_diverges_is_told_as_such_and_leaves_the_others_alone(paper, evaluated):
    logs = [log(paper, TRUE, seed) for seed in (1, 2)]
    absurd = given("absurd", {"viscous_friction": {"coefficient": 1e6}})
    found = evaluate_simulations([given("nominal", {}), absurd], logs, paper, settings())
    score = of(found, "absurd")
    assert score.diverged > 0
    assert score.is_worse
    assert (score.error, score.ratio, score.closed) == (None, None, None)
    assert of(found, "nominal") == of(evaluated, "nominal")
    beside = evaluate_simulations([absurd, given("nominal", {})], logs, paper, settings())
    assert of(beside, "nominal").error == of(evaluated, "nominal").error
    assert of(beside, "nominal").ratio is None


def test_channels_that_were_not_measured_are_neither_used_nor_told(paper):
    whole = log(paper, TRUE, 1)
    without = replace(whole, episode=replace(whole.episode, estimated=(Estimated("tilt_rate", 0.1),)))
    found = evaluate_simulations([given("nominal", {}), given("true", TRUE)], [without], paper, settings())
    assert set(found.channels) == {"tilt", "wheel_angle", "wheel_rate"}
    score = of(found, "true", without.name)
    assert score.error == pytest.approx(score.noise_floor, rel=0.3)


def test_an_offset_of_a_logs_tilt_is_found_for_each_simulation_alike_where_it_may_be_there(paper):
    plain = log(paper, TRUE, 3)
    seen = np.array(plain.episode.observations)
    seen[:, 1] += 0.03
    off = replace(plain, episode=replace(plain.episode, observations=seen))
    simulations = [given("nominal", {}), given("true", TRUE)]
    blind, seeing = (evaluate_simulations(simulations, [off], paper, settings(tilt_offset=sd)) for sd in (0.0, 0.03))
    assert of(blind, "true", off.name).error > 2.0 * of(seeing, "true", off.name).error
    assert of(seeing, "true", off.name).error == pytest.approx(of(seeing, "true", off.name).noise_floor, rel=0.3)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda one: replace(one, episode=part(one.episode, 30)), "upright for 0.6 s; expected are 0.5 s"),
        (
            lambda one: replace(one, episode=replace(one.episode, provenance=Provenance("regbot", "robot"))),
            "is of the robot 'regbot'; expected is 'paper'",
        ),
        (lambda one: replace(one, episode=replace(one.episode, control_period=0.01)), "control period"),
    ],
    ids=["too short", "another robot", "another period"],
)
def test_logs_that_cannot_be_predicted_are_refused(change, complaint, paper):
    bad = change(log(paper, TRUE, 1, periods=200, name="bad"))
    with pytest.raises(DataError, match=f"bad.*{complaint}"):
        evaluate_simulations([given("nominal", {})], [bad], paper, settings())


def part(episode, periods):
    rows = slice(0, periods + 1)
    return replace(
        episode,
        observations=episode.observations[rows],
        states=episode.states[rows],
        commands=episode.commands[:periods],
    )


@pytest.mark.parametrize(
    ("effects", "complaint"),
    [
        ({"antigravity": {"share": 1.0}}, "no parameter 'share' of an effect 'antigravity'"),
        ({"backlash": {"gap": 0.02}, "wheel_slip": {"friction": 0.5}}, "backlash, and wheels that slip"),
    ],
)
def test_effects_that_the_planar_model_cannot_do_are_refused(effects, complaint, paper):
    with pytest.raises(ConfigError, match=f"Simulation odd .odd.yaml.*{complaint}"):
        evaluate_simulations([given("nominal", {}), given("odd", effects)], [log(paper, {}, 1)], paper, settings())
