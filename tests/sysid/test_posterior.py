"""What rollouts tell of a robot, beside robots that are known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from filtered_tilt import FilteredTilt
from scipy.signal import savgol_filter

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.cost import cost_over
from twbal.core.episode import Episode, Estimated, Outcome, Provenance
from twbal.core.errors import DataError
from twbal.core.plant import Observation
from twbal.core.robot_parameters import GRAVITY
from twbal.core.robot_sheet import robot_sheet
from twbal.core.start_pose import StartPose
from twbal.effects.library import effects_from
from twbal.io.importers.tilt_by_gyro import tilt_by_gyro
from twbal.planar.linearised import sampled_with_delay
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant
from twbal.planar.robot_distribution import prior_of
from twbal.policies.exploring import ExploringPolicy
from twbal.search.linear_starts import linear_law, regulator, state_space
from twbal.sysid.posterior import posterior, roughness, tilt_error
from twbal.sysid.recording import Recording

NAMES = ("tilt", "tilt_rate", "speed", "command_1", "command_2", "position")
NOISE = {"tilt": 0.0035, "tilt_rate": 0.02, "wheel_angle": 0.001, "wheel_rate": 0.05}
UNSEEN = {"acceleration": 0.0, "yaw_rate": 0.0}
SMALL = {
    "name": "small",
    "control_period": 0.01,
    "wheel_mass": 0.04,
    "body_mass": 0.82,
    "wheel_radius": 0.033,
    "wheel_width": 0.026,
    "track": 0.16,
    "com_height": 0.07,
    "com_offset": 0.0,
    "wheel_inertia": 3.5e-5,
    "body_inertia_pitch": 1.8e-3,
    "body_inertia_roll": 2.5e-3,
    "body_inertia_yaw": 1.2e-3,
    "torque_limit": 0.35,
}
SEEN = ("actuation_delay_delay", "dead_zone_width", "com_offset_angle", "torque_gain_gain")


def episodes_of(robot, effects, seed, steps=200, count=1, scale=1.0, exploration=0.075, filter_rate=0.0):
    """Rollouts of the planar robot with effects, at finer steps than the estimator's, under a regulator with noise.

    With a filter rate its tilt comes from a complementary filter.
    """
    channels = Channels(NAMES, robot.wheel_radius, robot.control_period)
    linear = sampled_with_delay(planar_parameters(robot, {}), robot.control_period, 2)
    cost = cost_over(NAMES, {"tilt": 0.25, "tilt_rate": 2.5, "speed": 1.0, "position": 0.5}, 1.0, robot.torque_limit)
    gain = scale * regulator(*state_space(linear, channels), cost, robot.torque_limit)
    law = linear_law(NAMES, gain, robot.torque_limit, 0.0)
    policy = ExploringPolicy(law, exploration * robot.torque_limit, robot.torque_limit)
    plant = PlanarPlant(
        robot=robot,
        effects=effects_from({**effects, "sensor_noise": {**NOISE, **UNSEEN}}),
        start=StartPose(-0.1, 0.02, 0.05, 0.02),
        physics_step=robot.control_period / 40,
        seed=seed,
    )
    if filter_rate:
        plant = FilteredTilt(plant, filter_rate)
    told = [Provenance("paper", "robot", seed=seed, trial=trial) for trial in range(count)]
    return [rollout(plant, policy, channels, steps, 0.5236, each) for each in told]


def drawn(prior, seed):
    """Effects of a robot that the prior holds likely, and its numbers (P,)."""
    model = prior.models(2, np.random.default_rng(seed))[1]
    values = {field: getattr(model, field) for field in prior.fields}
    effects = {}
    for field, value in values.items():
        effect, parameter = field.rsplit("_", 1)
        effects[effect] = {parameter: value}
    return effects, np.array(list(values.values()))


def sds_off(prior, found, truth):
    """Distance from the truth in standard deviations, (P,); a thousandth of the torque limit in the dead zone is none.

    There the likelihood has a kink for each command, between which its curvature tells little.
    """
    variance = np.array(np.diag(found.covariance))
    variance[prior.fields.index("dead_zone_width")] += (1e-3 * prior.robot.torque_limit) ** 2
    return (found.mean - truth) / np.sqrt(variance)


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
def test_the_truth_lies_within_4_standard_deviations_and_these_are_small(paper, seed):
    effects = {
        "actuation_delay": {"delay": (0.012, 0.025, 0.034)[seed - 1]},
        "dead_zone": {"width": (1.8, 1.0, 2.6)[seed - 1]},
        "com_offset": {"angle": (0.05, -0.04, 0.02)[seed - 1]},
        "torque_gain": {"gain": (0.8, 1.3, 1.0)[seed - 1]},
    }
    prior = prior_of(paper)
    found = posterior(prior, episodes_of(paper, effects, seed))
    for field, (effect, parameter) in zip(
        SEEN,
        [("actuation_delay", "delay"), ("dead_zone", "width"), ("com_offset", "angle"), ("torque_gain", "gain")],
        strict=True,
    ):
        k = prior.fields.index(field)
        sd = np.sqrt(found.covariance[k, k])
        assert abs(found.mean[k] - effects[effect][parameter]) < 4 * sd, field
        assert sd < 0.5 * np.sqrt(prior.covariance[k, k]), field
    np.testing.assert_allclose(found.sensor_sd, list(NOISE.values()), rtol=0.5)


def ideal_robot(tilt=lambda seen, radius, period: seen[:, 1]):
    """The sheet of a robot that is as that says, and ten seconds of it; `tilt` gives what it shows of its tilt.

    A planar robot without friction, delay and geared rotors follows a speed to and fro, under a regulator and steps of
    torque. A simulator that shares nothing with twbal made the log (Euler at 0.5 ms, encoders of 1560 ticks a turn,
    commands in 255 steps), and `import-log` read it.
    """
    measured = ["wheel_mass", "body_mass", "wheel_radius", "wheel_width", "track", "com_height"]
    sources = {"measured": measured, "data_sheet": ["control_period", "wheel_inertia", "torque_limit"]}
    sources |= {"cad": ["body_inertia_pitch", "body_inertia_roll"], "guess": ["com_offset", "body_inertia_yaw"]}
    robot = robot_sheet(**SMALL, provenance=sources)
    log = np.load(Path(__file__).with_name("ideal_robot.npz"))
    seen = np.zeros((len(log["seen"]), 7))
    seen[:, 0], seen[:, [1, 2, 4, 5]] = robot.control_period * np.arange(len(seen)), log["seen"]
    seen[:, 1] = tilt(seen, robot.wheel_radius, robot.control_period)
    told = Provenance("small", "robot", seed=0, trial=0)
    return robot, Episode(("tilt",), robot.control_period, seen, seen[:, 1:2], log["commands"], Outcome.COMPLETED, told)


@pytest.mark.slow
def test_a_robot_without_a_filter_that_is_as_its_sheet_says_is_found_so():
    """Fits that began where that with a filter of 5 s ends gave a geared rotor 73 % of the wheels' inertia."""
    robot, episode = ideal_robot()
    prior = prior_of(robot)
    found = posterior(prior, [episode])
    by_name = dict(zip(prior.fields, found.mean, strict=True))
    assert by_name["rotor_inertia_share"] < 0.1
    assert by_name["com_height_factor"] == pytest.approx(1.0, abs=0.02)
    assert by_name["body_inertia_factor"] == pytest.approx(1.0, abs=0.03)
    assert found.filter_rate[0] + found.filter_rate[1] < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.99, 0.98])
def test_a_complementary_filter_of_a_usual_share_is_found(share):
    """At 100 Hz, shares of 0.99 and 0.98 of the gyro's sum are time constants of 1 and 0.5 s."""

    def filtered(seen, radius, period):
        speed = radius * savgol_filter(seen[:, 4] + seen[:, 1], 9, 3, deriv=1, delta=period)
        leaning = seen[:, 1] - np.arctan(np.gradient(speed, period) / GRAVITY)  # as an accelerometer sees it
        shown = [seen[0, 1]]
        for rate, by_accelerometer in zip(seen[1:, 2], leaning[1:], strict=True):
            shown.append(share * (shown[-1] + period * rate) + (1.0 - share) * by_accelerometer)
        return np.array(shown)

    robot, episode = ideal_robot(filtered)
    prior = prior_of(robot)
    found = posterior(prior, [episode])
    by_name = dict(zip(prior.fields, found.mean, strict=True))
    assert found.filter_rate[0] == pytest.approx((1.0 - share) / robot.control_period, rel=0.1)
    assert by_name["com_height_factor"] == pytest.approx(1.0, abs=0.03)
    assert by_name["torque_gain_gain"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_ten_likely_robots_lie_where_their_posteriors_say(paper):
    """With calibrated ones, of 90 distances 4 or 5 are beyond two standard deviations and none beyond four."""
    prior = prior_of(paper)
    off = []
    for seed in range(10):
        effects, truth = drawn(prior, 100 + seed)
        off.append(sds_off(prior, posterior(prior, episodes_of(paper, effects, seed)), truth))
    off = np.array(off)
    assert np.mean(np.abs(off) < 2) > 0.85
    assert np.abs(off).max() < 5
    assert 0.5 < np.sqrt(np.mean(off**2)) < 1.5


@pytest.fixture(scope="module")
def rubbing(paper):
    """A rollout of a robot with dry friction, and the posterior of what its sensors measured."""
    found = episodes_of(paper, {"coulomb_friction": {"torque": 0.3}, "actuation_delay": {"delay": 0.012}}, 3)
    return found, posterior(prior_of(paper), found)


def sds_apart(one, other):
    return np.abs(one.mean - other.mean) / np.sqrt(np.maximum(np.diag(one.covariance), np.diag(other.covariance)))


def test_rates_that_were_worked_out_from_angles_are_not_taken_for_measured(paper, rubbing):
    measured, known = rubbing
    worked_out = []
    for episode in measured:
        seen = episode.observations.copy()
        for angle, rate in (("tilt", "tilt_rate"), ("wheel_angle", "wheel_rate")):
            a, r = Observation._fields.index(angle), Observation._fields.index(rate)
            seen[:, r] = savgol_filter(seen[:, a], 9, 3, deriv=1, delta=paper.control_period)
        told = tuple(Estimated(name, 0.1) for name in ("tilt_rate", "wheel_rate"))
        worked_out.append(replace(episode, observations=seen, estimated=told))
    found = posterior(prior_of(paper), worked_out)
    assert sds_apart(found, known).max() < 2.0
    np.testing.assert_array_equal(found.sensor_sd[[1, 3]], prior_of(paper).sensor_sd[[1, 3]])
    alike = posterior(prior_of(paper), [replace(episode, estimated=()) for episode in worked_out])
    assert sds_apart(alike, known).max() > 3.0  # so the rates would have misled it


def test_a_tilt_that_was_summed_from_the_gyro_is_not_taken_for_measured_and_has_no_filter(paper, rubbing):
    measured, known = rubbing
    summed = []
    for episode in measured:
        seen = episode.observations.copy()
        rates = seen[:, Observation._fields.index("tilt_rate")]
        seen[:, Observation._fields.index("tilt")] = tilt_by_gyro({"tilt_rate": rates}, paper.control_period)
        summed.append(replace(episode, observations=seen, estimated=(Estimated("tilt", np.inf),)))
    found = posterior(prior_of(paper), summed)
    assert sds_apart(found, known).max() < 2.0
    assert found.filter_rate == prior_of(paper).filter_rate and found.sensor_sd[0] == prior_of(paper).sensor_sd[0]


def test_missed_periods_mislead_nothing(paper, rubbing):
    whole, known = rubbing
    rng, late = np.random.default_rng(5), []
    for episode in whole:
        kept = np.sort(rng.permutation(np.arange(1, 200))[:185])
        kept = np.concatenate([[0], kept, [200]])
        late.append(
            replace(
                episode,
                observations=episode.observations[kept],
                states=episode.states[kept],
                commands=episode.commands[kept[:-1]],
                poses=None,
            )
        )
    assert sds_apart(posterior(prior_of(paper), late), known).max() < 2.5


@pytest.mark.slow
def test_more_rollouts_tell_more(paper):
    prior, effects = prior_of(paper), {"dead_zone": {"width": 1.5}, "actuation_delay": {"delay": 0.02}}
    both = episodes_of(paper, effects, 4, count=2)
    one, two = (posterior(prior, both[:n]) for n in (1, 2))
    assert (
        np.linalg.slogdet(two.covariance)[1]
        < np.linalg.slogdet(one.covariance)[1]
        < np.linalg.slogdet(prior.covariance)[1]
    )


def test_what_rollouts_do_not_tell_stays_as_it_was(paper):
    """Masses of a robot that hardly moves: a falling one for a fifth of a second under no command."""
    prior = prior_of(paper)
    found = posterior(prior, episodes_of(paper, {}, 5, steps=10, scale=0.0, exploration=0.0))
    for field in ("dead_zone_width", "torque_gain_gain", "actuation_delay_delay"):
        k = prior.fields.index(field)
        sd = np.sqrt(prior.covariance[k, k])
        assert abs(found.mean[k] - prior.mean[k]) < 0.1 * sd, field
        assert np.sqrt(found.covariance[k, k]) == pytest.approx(sd, rel=0.05), field


def test_a_covariance_is_one_and_values_stay_within_their_bounds(paper):
    prior = prior_of(paper)
    found = posterior(prior, episodes_of(paper, {"actuation_delay": {"delay": 0.0}}, 6))
    np.testing.assert_array_equal(found.covariance, found.covariance.T)
    assert np.linalg.eigvalsh(found.covariance / np.outer(*[np.sqrt(np.diag(found.covariance))] * 2)).min() > 0
    assert (found.mean >= prior.low).all() and (found.mean <= prior.high).all()
    assert found.fields == prior.fields and found.robot == prior.robot


def test_a_robot_that_lies_on_the_ground_tells_nothing(paper):
    episode = episodes_of(paper, {}, 7)[0]
    lying = np.array(episode.observations)
    lying[:, 1] = 1.2
    with pytest.raises(DataError, match="None of 2 episodes has 5 control periods of a robot that stands"):
        posterior(prior_of(paper), [replace(episode, observations=lying)] * 2)


def test_wheels_in_another_unit_end_in_no_traceback(paper):
    """In ticks they are so fast that a filter of the tilt would have hidden a robot that lies: no such one is tried."""
    wheels = [Observation._fields.index(name) for name in ("wheel_angle", "wheel_rate")]
    episodes = episodes_of(paper, {}, 3)
    in_ticks = np.ones(len(Observation._fields))
    in_ticks[wheels] = 300.0
    found = posterior(prior_of(paper), [replace(e, observations=e.observations * in_ticks) for e in episodes])
    assert np.isfinite(found.mean).all() and np.isfinite(found.filter_rate).all()


@pytest.mark.slow
def test_what_comes_after_a_fall_is_not_used(paper):
    prior, episode = prior_of(paper), episodes_of(paper, {}, 8, steps=100)[0]
    fallen, wild = np.array(episode.observations), np.array(episode.observations)
    for each, tilt in ((fallen, 0.9), (wild, -1.4)):
        each[80:, 1] = tilt
    wild[80:, 2:] *= -3.0
    one, other = (posterior(prior, [replace(episode, observations=seen)]) for seen in (fallen, wild))
    np.testing.assert_array_equal(one.mean, other.mean)
    np.testing.assert_array_equal(one.covariance, other.covariance)


HIDDEN = {"com_offset": {"angle": 0.04}, "actuation_delay": {"delay": 0.012}, "dead_zone": {"width": 1.0}}


@pytest.mark.parametrize("rate", [pytest.param(0.0, marks=pytest.mark.slow), 0.3])
def test_the_rate_of_a_tilt_filter_is_found_and_the_robot_beside_it(paper, rate):
    prior = prior_of(paper)
    found = posterior(prior, episodes_of(paper, HIDDEN, 11, count=2, filter_rate=rate))
    mean, sd = found.filter_rate
    assert sd < 0.3 * prior.filter_rate[1]
    assert abs(mean - rate) < 3 * sd
    for effect, parameter in (("com_offset", "angle"), ("actuation_delay", "delay")):
        k = prior.fields.index(f"{effect}_{parameter}")
        off = found.mean[k] - HIDDEN[effect][parameter]
        assert abs(off) < 4 * np.sqrt(found.covariance[k, k]), effect


def test_what_a_filter_adds_to_the_tilt_is_what_a_real_one_adds(paper):
    """A filter's tilt less the true one, beside what the readings of wheels and gyro tell of it, without noise."""
    plant = PlanarPlant(
        robot=paper, effects=[], start=StartPose(-0.02, 0.0, 0.0, 0.0), physics_step=paper.control_period / 40, seed=0
    )
    filtered, commands = FilteredTilt(plant, 0.4), np.random.default_rng(0).normal(0.0, 4.0, 25)
    seen, true = [filtered.reset(0)], [plant.pose().tilt]
    for command in commands:
        seen.append(filtered.step(command))
        true.append(plant.pose().tilt)
    added = np.array([each.tilt for each in seen]) - true
    told = tilt_error(np.array(seen), paper.wheel_radius, paper.control_period, 0.4)
    assert np.abs(added).max() > 0.005
    np.testing.assert_allclose(told, added, atol=0.05 * np.abs(added).max())


def moving(noise, seed, shake=0.0):
    """A recording of slow waves with noise of four standard deviations, and jolts here and there."""
    rng, times = np.random.default_rng(seed), 0.02 * np.arange(400)
    waves = np.column_stack(
        [a * np.sin(2.0 * np.pi * f * times) for a, f in ((0.05, 1.0), (0.3, 1.0), (2, 0.5), (6, 0.5))]
    )
    jolts = shake * (rng.random((400, 1)) < 0.05)
    seen = waves + (np.array(noise) + jolts) * rng.standard_normal((400, 4))
    return Recording("", 0.02, np.zeros(399), seen, np.zeros(400), np.ones(400, dtype=bool), np.ones(4, dtype=bool))


@pytest.mark.parametrize("shake", [0.0, 5.0])
def test_second_differences_tell_the_noise_of_sensors_and_little_else(shake):
    noise = (0.0035, 0.02, 0.05, 0.05)
    found = roughness([moving(noise, 1, shake), moving(noise, 2, shake)])
    assert (0.9 * np.array(noise) < found).all()
    assert (found < 1.4 * np.array(noise)).all()
    assert (roughness([moving((0.0,) * 4, 3)]) < [0.001, 0.005, 0.01, 0.03]).all()
