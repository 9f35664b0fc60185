"""Compiled rollouts of planar models, beside the one loop that drives every robot and the rule that judges it."""

from typing import NamedTuple

import numpy as np
import pytest
from filtered_tilt import FilteredTilt
from old_rates import OldRates

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.cost import cost_over
from twbal.core.episode import Provenance
from twbal.core.evaluation import SuccessCriterion, judged, real_cost
from twbal.core.plant import Pose
from twbal.core.start_pose import StartPose
from twbal.core.streams import Stream, generator
from twbal.effects.library import effects_from
from twbal.planar.linearised import sampled_with_delay, torque_response
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant
from twbal.search.linear_starts import linear_law, regulator, state_space
from twbal.search.planar_rollouts import Driven, PlanarDraws, planar_rollouts
from twbal.search.sampled_rollouts import limits_of

NAMES = ("tilt", "tilt_rate", "speed", "command_1", "command_2", "position", "position_integral")
WIDTHS = {"tilt": 0.25, "tilt_rate": 2.5, "speed": 1.0, "position": 0.5, "position_integral": 0.5}
NOISE = (0.0035, 0.02, 0.001, 0.05)  # tilt, tilt rate, wheel angle, wheel rate
START = StartPose(-0.1, 0.03, 0.05, 0.02)
LATE = {"actuation_delay": {"delay": 0.015}}
RULE = {"settled_tilt_limit": 0.17453, "duration": 6.0, "settle_time": 2.0, "place_time": 3.0}


class Case(NamedTuple):
    """A robot, a policy, and the parts of the rule that a trial shows.

    Attributes:
        effects: of the robot.
        widths: of the cost by which its regulator is designed.
        scale: of the regulator's gain.
        compensation: of the policy.
        shows: upright, settled, in place, quiet.
    """

    effects: dict
    widths: dict
    scale: float
    compensation: float
    shows: tuple[bool, bool, bool, bool]


ROLLING = {name: WIDTHS[name] for name in ("tilt", "tilt_rate", "speed")}
CASES = {
    "it stays": Case(LATE, WIDTHS, 1.0, 0.0, (True, True, True, True)),
    "a dead zone, compensated": Case(
        {"dead_zone": {"width": 1.0}, "imu_delay": {"delay": 0.007}, "coulomb_friction": {"torque": 0.1}},
        WIDTHS,
        0.7,
        0.03,
        (True, True, True, True),
    ),
    "wheels larger than its sheet says": Case(
        {"wheel_radius": {"factor": 1.2}, **LATE}, WIDTHS, 1.0, 0.0, (True, True, True, True)
    ),
    "it rolls away": Case({"com_offset": {"angle": 0.06}, **LATE}, ROLLING, 1.0, 0.0, (True, True, False, True)),
    "it shakes": Case(LATE, WIDTHS, 1.0, 0.5, (True, True, True, False)),
    "it falls": Case(LATE, WIDTHS, 0.1, 0.0, (False, False, False, False)),
}


def policy_for(robot, channels, case):
    linear = sampled_with_delay(planar_parameters(robot, LATE), robot.control_period, 2)
    cost = cost_over(channels.names, case.widths, 1.0, robot.torque_limit)
    gain = regulator(*state_space(linear, channels), cost, robot.torque_limit)
    return linear_law(channels.names, case.scale * gain, robot.torque_limit, case.compensation)


def rule_for(robot):
    return SuccessCriterion.in_seconds(
        tilt_limit=0.5236,
        place_radii=1.0,
        command_change=0.1,
        control_period=robot.control_period,
        wheel_radius=robot.wheel_radius,
        torque_limit=robot.torque_limit,
        **RULE,
    )


def undisturbed(start, sensors):
    """Draws of robots on which nothing pushes and whose tilts are what they say."""
    return PlanarDraws(start, sensors, np.zeros((*sensors.shape[:2], 2)), np.zeros(len(start)), np.zeros(len(start)))


def told_by_plant(robot, effects, policy, channels, rule, filter_rate=0.0):
    """Episode of a plant without noise, its tilt from a complementary filter, and the stance at its beginning."""
    plant = PlanarPlant(robot=robot, effects=effects_from(effects), start=START, physics_step=0.001, seed=3)
    shown = FilteredTilt(plant, filter_rate) if filter_rate else plant
    episode = rollout(shown, policy, channels, rule.steps, rule.tilt_limit, Provenance("paper", "robot", trial=0))
    return episode, START.draw(generator(Stream.START_POSE, 3, 0))


def told_by_kernel(robot, effects, policy, channels, rule, cost, drawn):
    """The same robot by compiled code."""
    limits, model = limits_of(rule, channels.names), planar_parameters(robot, effects)
    return planar_rollouts([model], channels, policy, cost, limits, drawn, robot.control_period)


def driven(robot, case, policy, channels, rule, cost, noise, trial):
    """Episode of the plant, and the same robot by compiled code with the same start and noises."""
    shown = dict(zip(("tilt", "tilt_rate", "wheel_angle", "wheel_rate"), noise, strict=True))
    sensors = {"sensor_noise": {**shown, "acceleration": 0.0, "yaw_rate": 0.0}}
    plant = PlanarPlant(
        robot=robot, effects=effects_from({**case.effects, **sensors}), start=START, physics_step=0.001, seed=3
    )
    episode = rollout(plant, policy, channels, rule.steps, rule.tilt_limit, Provenance("paper", "robot", trial=trial))
    draws = generator(Stream.SENSOR_NOISE, 3, trial).standard_normal((rule.steps + 1, 6))
    stance = START.draw(generator(Stream.START_POSE, 3, trial))
    shown = np.full((1, rule.steps + 1, len(channels.names)), np.nan)
    found = planar_rollouts(
        [planar_parameters(robot, case.effects)],
        channels,
        policy,
        cost,
        limits_of(rule, channels.names),
        undisturbed(np.array([stance]), (np.array(noise) * draws[:-1, [0, 1, 3, 4]])[None]),
        robot.control_period,
        shown,
    )
    return episode, found, shown[0]


@pytest.mark.parametrize("noise", [(0.0,) * 4, NOISE], ids=["no noise", "noise"])
@pytest.mark.parametrize("name", CASES)
def test_a_robot_does_what_it_does_behind_the_seam_and_is_judged_alike(paper, name, noise):
    case, channels = CASES[name], Channels(NAMES, paper.wheel_radius, paper.control_period)
    policy, rule = policy_for(paper, channels, case), rule_for(paper)
    cost = cost_over(NAMES, WIDTHS, 1.0, paper.torque_limit, 0.3)
    for trial in range(3):
        episode, found, shown = driven(paper, case, policy, channels, rule, cost, noise, trial)
        verdict = judged(episode, rule)
        assert (verdict.upright, verdict.settled, verdict.in_place, verdict.quiet) == case.shows
        assert bool(found.used[0] <= 1.0) == verdict.succeeded
        if verdict.upright and not any(noise):
            settled = np.abs(episode.tilt[rule.settle_step :]).max() / rule.settled_tilt_limit
            shares = settled, verdict.farthest / rule.place_limit, verdict.command_change / rule.command_change
            assert found.used[0] == pytest.approx(min(max(shares), 3.0), rel=1e-6)
            swing = np.ptp(episode.poses[rule.place_step :, Pose._fields.index("tilt")])
            assert found.swings[0] == pytest.approx(swing / rule.settled_tilt_limit, rel=1e-6)
            if "imu_delay" not in case.effects:
                assert found.swings[0] == pytest.approx(verdict.oscillation / rule.settled_tilt_limit, rel=1e-6)
        expected = real_cost(episode, cost, rule.steps)
        if not verdict.upright:
            expected += 1.0 - float(cost(episode.states[-1]))  # a rollout ends after its fall, which counts here
        steps = len(episode.states) - 1  # the last is fallen, or has another noise
        np.testing.assert_allclose(shown[:steps], episode.states[:steps], rtol=1e-9, atol=1e-9)
        assert np.isnan(shown[steps + 1 :]).all()
        # all but the noise on the very last state are the same draws
        assert found.costs[0] * rule.steps == pytest.approx(expected, rel=1e-9, abs=1e-9 if not any(noise) else 0.2)


@pytest.mark.parametrize("names", [("yaw_rate", "tilt_rate", "acceleration", "tilt"), NAMES[::-1]], ids=str)
def test_every_channel_is_where_the_state_has_it(paper, names):
    channels = Channels(names, paper.wheel_radius, paper.control_period)
    gains = {"tilt": -60.0, "tilt_rate": -9.0, "speed": -4.0, "acceleration": 0.2, "position": -3.0}
    gain = np.array([gains.get(name, 0.05) for name in names])
    policy = linear_law(names, gain, paper.torque_limit, 0.0)
    rule = rule_for(paper)
    cost = cost_over(names, {**WIDTHS, "acceleration": 15.0, "yaw_rate": 1.0}, 1.0, paper.torque_limit)
    case = CASES["it stays"]
    episode, found, shown = driven(paper, case, policy, channels, rule, cost, (0.0,) * 4, 0)
    np.testing.assert_allclose(shown, episode.states, rtol=1e-9, atol=1e-12)
    assert len(episode) == rule.steps
    assert found.costs[0] * rule.steps == pytest.approx(real_cost(episode, cost, rule.steps), rel=1e-9)


def test_sensors_that_are_off_are_so_from_the_first_instant_on(paper):
    channels, rule = Channels(NAMES, paper.wheel_radius, paper.control_period), rule_for(paper)
    policy = policy_for(paper, channels, CASES["it stays"])
    cost = cost_over(NAMES, WIDTHS, 1.0, paper.torque_limit)
    off = Case({"imu_mount_angle": {"angle": 0.05}, "gyro_bias": {"rate": 0.02}}, WIDTHS, 1.0, 0.0, (True,) * 4)
    episode, _, shown = driven(paper, off, policy, channels, rule, cost, (0.0,) * 4, 0)
    steps = len(episode.states) - 1
    np.testing.assert_allclose(shown[:steps], episode.states[:steps], rtol=1e-9, atol=1e-9)


def test_robots_do_not_see_each_other(paper):
    channels, rule = Channels(NAMES, paper.wheel_radius, paper.control_period), rule_for(paper)
    cost, rng = cost_over(NAMES, WIDTHS, 1.0, paper.torque_limit), np.random.default_rng(0)
    models = [planar_parameters(paper, case.effects) for case in CASES.values()]
    draws = PlanarDraws(
        0.05 * rng.standard_normal((len(models), 3)),
        np.array(NOISE) * rng.standard_normal((len(models), rule.steps, 4)),
        0.01 * rng.standard_normal((len(models), rule.steps, 2)),
        rng.uniform(0.0, 0.3, len(models)),
        rng.uniform(0.0, 0.5, len(models)),
    )
    policy = policy_for(paper, channels, CASES["it stays"])

    def drive(which):
        return planar_rollouts(
            [models[i] for i in which],
            channels,
            policy,
            cost,
            limits_of(rule, channels.names),
            PlanarDraws(*(part[which] for part in draws)),
            paper.control_period,
        )

    together, alone = drive(list(range(len(models)))), [drive([i]) for i in range(len(models))]
    np.testing.assert_array_equal(together.costs, [each.costs[0] for each in alone])
    np.testing.assert_array_equal(together.used, [each.used[0] for each in alone])
    np.testing.assert_array_equal(together.swings, [each.swings[0] for each in alone])
    assert len(set(together.costs)) == len(models)


def test_constant_jolts_cost_what_a_constant_force_costs(paper):
    """Jolts come at the end of a control period, a force acts throughout: rates are seen half a jolt off."""
    case, channels, rule = CASES["it stays"], Channels(NAMES, paper.wheel_radius, paper.control_period), rule_for(paper)
    policy, cost = policy_for(paper, channels, case), cost_over(NAMES, WIDTHS, 1.0, paper.torque_limit, 0.3)
    force, outside = 4.0, torque_response(planar_parameters(paper, case.effects), paper.control_period)[:, 1]
    pushing = {"periodic_disturbance": {"force": force, "frequency": 0.0, "phase": np.pi / 2}}
    episode, stance = told_by_plant(paper, {**case.effects, **pushing}, policy, channels, rule)
    calm = undisturbed(np.array([stance]), np.zeros((1, rule.steps, 4)))
    drawn = calm._replace(jolts=np.tile(force * paper.wheel_radius * outside, (1, rule.steps, 1)))
    pushed, alone = (
        told_by_kernel(paper, case.effects, policy, channels, rule, cost, each).costs[0] * rule.steps
        for each in (drawn, calm)
    )
    truth = real_cost(episode, cost, rule.steps)
    assert alone < 0.6 * truth
    assert pushed == pytest.approx(truth, rel=0.02)


@pytest.mark.parametrize("rate", [0.4, 1.0])
def test_a_tilt_from_a_complementary_filter_drives_as_one_does(paper, rate):
    case, channels, rule = CASES["it stays"], Channels(NAMES, paper.wheel_radius, paper.control_period), rule_for(paper)
    policy, cost = policy_for(paper, channels, case), cost_over(NAMES, WIDTHS, 1.0, paper.torque_limit, 0.3)
    episode, stance = told_by_plant(paper, case.effects, policy, channels, rule, rate)
    calm = undisturbed(np.array([stance]), np.zeros((1, rule.steps, 4)))
    drawn = calm._replace(filter_rates=np.array([rate]))
    filtered, alone = (
        told_by_kernel(paper, case.effects, policy, channels, rule, cost, each) for each in (drawn, calm)
    )
    truth = real_cost(episode, cost, rule.steps)
    gap = abs(truth - alone.costs[0] * rule.steps)
    assert gap > 0.02 * truth
    assert abs(filtered.costs[0] * rule.steps - truth) < 0.1 * gap
    swing = np.ptp(episode.poses[rule.place_step :, Pose._fields.index("tilt")]) / rule.settled_tilt_limit
    assert filtered.swings[0] == pytest.approx(swing, rel=0.1)


def test_the_greater_of_limits_used_and_oscillation_counts():
    found = Driven(used=np.array([0.5, 2.0]), swings=np.array([1.0, 0.1]), costs=np.zeros(2))
    assert found.mean_use == 1.5


@pytest.mark.parametrize("age", [0.25, 0.5])
def test_old_wheel_rates_drive_as_those_of_a_plant_do(paper, age):
    case, channels, rule = CASES["it stays"], Channels(NAMES, paper.wheel_radius, paper.control_period), rule_for(paper)
    policy, cost = policy_for(paper, channels, case), cost_over(NAMES, WIDTHS, 1.0, paper.torque_limit, 0.3)
    plant = PlanarPlant(robot=paper, effects=effects_from(case.effects), start=START, physics_step=0.001, seed=3)
    told = Provenance("paper", "robot", trial=0)
    episode = rollout(OldRates(plant, age), policy, channels, rule.steps, rule.tilt_limit, told)
    stance = START.draw(generator(Stream.START_POSE, 3, 0))
    new = undisturbed(np.array([stance]), np.zeros((1, rule.steps, 4)))
    old, alone = (
        told_by_kernel(paper, case.effects, policy, channels, rule, cost, each).costs[0] * rule.steps
        for each in (new._replace(rate_ages=np.array([age])), new)
    )
    truth = real_cost(episode, cost, rule.steps)
    assert truth > 1.05 * alone
    assert old == pytest.approx(truth, rel=1e-9)
