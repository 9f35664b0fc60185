"""Verdicts on trials, against cases that can be worked out by hand and against draws from a known distribution."""

from dataclasses import replace

import numpy as np
import pytest

from twbal.core.coverage import calibrated, coverage95
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import ConfigError, DataError
from twbal.core.evaluation import (
    PlaceBy,
    SuccessCriterion,
    TrialVerdict,
    check_horizon,
    drift,
    judged,
    positions,
    real_cost,
)
from twbal.core.gaussian import Array, Gaussian

RULE = SuccessCriterion(tilt_limit=0.5, settled_tilt_limit=0.2, settle_step=10, steps=50)


def episode(tilt: Array, states: Array | None = None, wheel_angle: Array | None = None) -> Episode:
    count = len(tilt)
    observations = np.zeros((count, 7))
    observations[:, 0] = 0.02 * np.arange(count)
    observations[:, 1] = tilt
    observations[:, 4] = 0.0 if wheel_angle is None else wheel_angle
    kept = tilt[:, None] if states is None else states
    names = ("tilt", "tilt_rate", "command_1")[: kept.shape[1]]
    commands = np.zeros(count - 1)
    return Episode(names, 0.02, observations, kept, commands, Outcome.COMPLETED, Provenance("paper", "simulation"))


def damped_tilt(steps: int, rate: float) -> Array:
    t = 0.02 * np.arange(steps + 1)
    tilt: Array = -0.17 * np.exp(rate * t) * np.cos(5.0 * t)
    return tilt


def test_a_damped_tilt_succeeds_and_a_growing_one_does_not() -> None:
    assert judged(episode(damped_tilt(50, -2.0)), RULE).succeeded
    assert not judged(episode(damped_tilt(50, 1.5)), RULE).succeeded


def test_a_trial_that_ends_early_fails() -> None:
    assert not judged(episode(damped_tilt(49, -2.0)), RULE).succeeded


@pytest.mark.parametrize(
    ("step", "tilt", "expected"),
    [(9, 0.3, True), (10, 0.3, False), (50, -0.3, False), (51, 0.3, True), (9, -0.51, False), (9, 0.5, True)],
)
def test_each_limit_holds_where_it_should(step: int, tilt: float, expected: bool) -> None:
    course = np.zeros(61)
    course[step] = tilt
    assert judged(episode(course), RULE).succeeded is expected


def test_a_rule_that_cannot_be_met_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"at most tilt_limit; found 0\.6 and 0\.5"):
        replace(RULE, settled_tilt_limit=0.6)
    with pytest.raises(ConfigError, match="step 51 of a trial of 50"):
        replace(RULE, settle_step=51)


def linear_system(steps: int) -> list[Gaussian]:
    """Exact p(x_t) of x' = A x + noise, a damped oscillation."""
    A, Q = np.array([[0.99, 0.02], [-0.5, 0.9]]), np.diag([1e-4, 1e-2])
    steps_seen = [Gaussian(np.array([-0.17, 0.0]), np.diag([4e-4, 1e-2]))]
    for _ in range(steps):
        m, S = steps_seen[-1]
        steps_seen.append(Gaussian(A @ m, A @ S @ A.T + Q))
    return steps_seen


def test_states_drawn_from_the_prediction_are_covered_95_times_in_100() -> None:
    rng = np.random.default_rng(3)
    predicted = linear_system(40)
    draws = [np.array([p.sample(1, rng)[0] for p in predicted]) for _ in range(150)]
    share = coverage95(predicted, [episode(x[:, 0], x) for x in draws], [0, 1])
    assert share == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / (150 * 40)))


def test_only_measured_channels_and_predicted_steps_after_the_start_count() -> None:
    predicted = linear_system(3)
    course = np.array([p.mean for p in predicted] + [[9.0, 9.0]])
    course[0] = 9.0
    course[1:, 1] += 5.0
    assert coverage95(predicted, [episode(course[:, 0], course)], [0]) == 1.0
    assert coverage95(predicted, [episode(course[:, 0], course)], [1]) == 0.0
    assert coverage95(predicted, [episode(course[:, 0], course)], [0, 1]) == 0.5


def test_a_short_episode_weighs_by_the_steps_that_it_has() -> None:
    predicted = linear_system(10)
    inside = np.array([p.mean for p in predicted])
    outside = inside[:3] + 9.0
    assert coverage95(predicted, [episode(x[:, 0], x) for x in (inside, outside)], [0, 1]) == pytest.approx(10 / 12)


def test_the_share_of_the_limits_is_that_of_the_limit_that_is_used_most() -> None:
    rule = SuccessCriterion(
        tilt_limit=0.5,
        settled_tilt_limit=0.2,
        settle_step=2,
        steps=10,
        place_step=5,
        place_radii=1.0,
        command_change=0.1,
        wheel_radius=0.1,
        torque_limit=10.0,
    )
    tilt = np.full(11, 0.05)
    tilt[0] = 0.19  # before it must have settled
    still = episode(tilt)
    assert judged(still, rule).used == pytest.approx(0.25)
    shaken = replace(still, commands=0.3 * (-1.0) ** np.arange(10))
    assert judged(shaken, rule).used == pytest.approx(0.06 / 0.1)
    away = np.zeros((11, 4))
    away[7, 1] = 0.09
    assert judged(replace(still, poses=away), rule).used == pytest.approx(0.9)
    assert judged(episode(np.full(8, 0.05)), rule).used == np.inf


def test_nothing_to_compare_is_an_error() -> None:
    with pytest.raises(DataError, match="None of the 1 episodes"):
        coverage95(linear_system(3), [episode(np.zeros(1), np.zeros((1, 2)))], [0])
    with pytest.raises(DataError, match="2 channels, the episode 1"):
        coverage95(linear_system(3), [episode(np.zeros(4))], [0])


def test_bands_that_miss_a_steady_error_are_widened_until_other_rollouts_lie_in_them() -> None:
    rng = np.random.default_rng(4)
    predicted = linear_system(40)

    def off() -> Episode:
        course = np.array([p.sample(1, rng)[0] for p in predicted])
        course[1:] += [0.0, 2.0 * predicted[-1].sd[1]]
        return episode(course[:, 0], course)

    others = [off() for _ in range(100)]
    wide = calibrated(predicted, [off() for _ in range(20)], [0, 1])
    assert coverage95(predicted, others, [1]) < 0.7
    assert coverage95(wide, others, [1]) == pytest.approx(0.95, abs=0.03)
    assert coverage95(wide, others, [0]) == pytest.approx(0.95, abs=0.03)


def test_bands_that_are_too_wide_are_narrowed_half_of_the_way() -> None:
    rng = np.random.default_rng(5)
    predicted = linear_system(40)
    narrow = [Gaussian(p.mean, p.covariance / 9.0) for p in predicted]

    def driven() -> Episode:
        course = np.array([p.sample(1, rng)[0] for p in narrow])
        return episode(course[:, 0], course)

    found = calibrated(predicted, [driven() for _ in range(50)], [0, 1])
    ratios = np.array([b.sd / a.sd for a, b in zip(predicted[1:], found[1:], strict=True)])
    np.testing.assert_allclose(ratios, 1.0 / np.sqrt(3.0), rtol=0.05)
    assert 0.95 < coverage95(found, [driven() for _ in range(100)], [0, 1]) < 1.0


def test_past_commands_and_the_start_stay_and_no_band_gets_narrower_than_half() -> None:
    predicted = linear_system(6)
    before = np.array([p.covariance for p in predicted])
    course = np.array([p.mean for p in predicted])
    same = calibrated(predicted, [episode(course[:, 0], course)], [0])
    after = np.array([p.covariance for p in same])
    np.testing.assert_array_equal(after[0], before[0])
    np.testing.assert_allclose(after[1:, 0, 0], 0.25 * before[1:, 0, 0])
    np.testing.assert_allclose(after[1:, 0, 1], 0.5 * before[1:, 0, 1])
    np.testing.assert_array_equal(after[:, 1, 1], before[:, 1, 1])
    course[1:] += 1.0
    wide = calibrated(predicted, [episode(course[:, 0], course)], [0])
    growth = np.array([p.covariance for p in wide]) - before
    assert not growth[0].any()
    growth = growth[1:]
    needed = (1.0 / 1.96) ** 2 - max(0.0, min(p.sd[0] ** 2 for p in predicted[1:]))
    assert 0 < growth[0, 0, 0] <= needed + 1e-12
    growth[:, 0, 0] = 0.0
    assert not growth.any()


def test_bands_cannot_be_calibrated_by_episodes_of_another_state() -> None:
    with pytest.raises(DataError, match="2 channels, the episode 1"):
        calibrated(linear_system(3), [episode(np.zeros(4))], [0])


def squared(states: Array) -> Array:
    cost: Array = np.minimum(states[:, 0] ** 2, 1.0)
    return cost


def test_the_cost_sums_the_horizon_without_the_start() -> None:
    course = np.array([9.0, 0.5, 0.1, 0.2, 7.0])
    assert real_cost(episode(course), squared, horizon=3) == pytest.approx(0.25 + 0.01 + 0.04)


def test_each_step_after_a_fall_costs_one() -> None:
    fell = {"outcome": Outcome.TILT_LIMIT}
    assert real_cost(replace(episode(np.array([0.0, 0.5])), **fell), squared, horizon=100) == pytest.approx(0.25 + 99)
    assert real_cost(replace(episode(np.array([0.0])), **fell), squared, horizon=100) == 100.0


def test_a_completed_rollout_that_is_shorter_than_the_horizon_has_no_cost() -> None:
    assert real_cost(episode(np.zeros(4)), squared, horizon=3) == 0.0
    with pytest.raises(DataError, match="A completed rollout of 3 control periods has no long-term cost over 4"):
        real_cost(episode(np.zeros(4)), squared, horizon=4)


def test_a_trial_that_ends_before_the_horizon_of_its_cost_is_refused() -> None:
    check_horizon(RULE, 50)
    with pytest.raises(ConfigError, match=r"success\.duration of 50 control periods and search\.horizon=51"):
        check_horizon(RULE, 51)


def test_a_wheel_rolling_under_a_tilting_body_is_followed_over_ground() -> None:
    rolled = np.linspace(0.0, -2.0, 51)
    tilt = damped_tilt(50, -1.0)
    course = episode(tilt, wheel_angle=rolled / 0.15 - tilt + 3.0)
    np.testing.assert_allclose(positions(course, wheel_radius=0.15), rolled, atol=1e-12)
    assert drift(course, wheel_radius=0.15) == pytest.approx(2.0)


# Each part of the rule, at its edge

PERIODS = (0.02, 0.015, 0.007)
RADIUS, LIMIT = 0.15, 20.0


def as_a_user_sees_it(period: float, **changes: float | None) -> SuccessCriterion:
    asked: dict[str, float | None] = {
        "tilt_limit": np.radians(30),
        "settled_tilt_limit": np.radians(10),
        "duration": 10.0,
        "settle_time": 2.0,
        "place_time": 5.0,
        "place_radii": 1.0,
        "command_change": 0.1,
        "control_period": period,
        "wheel_radius": RADIUS,
        "torque_limit": LIMIT,
        "heading_limit": float(np.radians(10)),
    }
    return SuccessCriterion.in_seconds(**{**asked, **changes})  # type: ignore[arg-type]


class Course:
    """A trial of a little over 10 s that is still and upright where it was put, until something is changed in it."""

    def __init__(self, period: float, seconds: float = 10.2) -> None:
        steps = int(seconds / period)
        self.period, self.time = period, period * np.arange(steps + 1)
        self.tilt, self.rolled, self.commands = np.zeros(steps + 1), np.zeros(steps + 1), np.zeros(steps)
        self.poses: Array | None = None
        self.headings: Array | None = None

    def at(self, second: float) -> int:
        """The first sample at or after this time."""
        return int(np.flatnonzero(self.time >= second - 1e-9)[0])

    @property
    def episode(self) -> Episode:
        seen = np.zeros((len(self.time), 7))
        seen[:, 0], seen[:, 1], seen[:, 4] = self.time, self.tilt, self.rolled / RADIUS - self.tilt
        source = Provenance("paper", "robot")
        return Episode(
            ("tilt",),
            self.period,
            seen,
            self.tilt[:, None],
            self.commands,
            Outcome.COMPLETED,
            source,
            poses=self.poses,
            headings=self.headings,
        )

    def verdict(self, **changes: float | None) -> TrialVerdict:
        return judged(self.episode, as_a_user_sees_it(self.period, **changes))


@pytest.mark.parametrize("period", PERIODS)
def test_a_trial_that_is_still_shows_all_parts(period: float) -> None:
    found = Course(period).verdict()
    assert found.succeeded
    assert found[:5] == (True, True, True, True, PlaceBy.ODOMETRY)
    assert (found.farthest, found.command_change, found.oscillation) == (0.0, 0.0, 0.0)
    assert found.seconds == pytest.approx(10.0, abs=period)


@pytest.mark.parametrize("period", PERIODS)
def test_ten_seconds_are_ten_seconds_for_any_control_period(period: float) -> None:
    rule = as_a_user_sees_it(period)
    for steps, seconds in ((rule.steps, 10.0), (rule.settle_step, 2.0), (rule.place_step, 5.0)):
        assert seconds - 1e-9 <= steps * period < seconds + period
    whole = Course(period, 10.0 + 1.5 * period)
    assert whole.verdict().succeeded
    short = judged(Course(period, 10.0 - 1.5 * period).episode, rule)
    assert short[:4] == (False,) * 4
    assert not short.succeeded


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize(
    ("second", "degrees", "upright", "settled"),
    [
        (0.5, 29.9, True, True),
        (0.5, -30.1, False, True),
        (1.99, 29.9, True, True),
        (2.0, 9.99, True, True),
        (2.0, -10.01, True, False),
        (10.0, 10.01, True, False),
        (10.0, 30.1, False, False),
        (10.1, 80.0, True, True),  # after the end
    ],
)
def test_tilt_limits_hold_from_their_times_on(
    period: float, second: float, degrees: float, upright: bool, settled: bool
) -> None:
    course = Course(period)
    place = course.at(second) if second != 1.99 else course.at(2.0) - 1
    course.tilt[place] = np.radians(degrees)
    found = course.verdict()
    assert (found.upright, found.settled) == (upright, settled)
    assert found.succeeded == (upright and settled)


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize("by", list(PlaceBy))
@pytest.mark.parametrize(
    ("seconds", "away", "in_place"),
    [
        ((0.1, 4.95), 9.0, True),
        ((5.0, 5.1), 0.1499, True),
        ((5.0, 5.1), -0.1501, False),
        ((9.9, 10.0), 0.1501, False),
        ((10.1, 10.2), 9.0, True),
    ],
)
def test_it_must_be_within_a_wheel_radius_of_where_it_was_put_from_five_seconds_on(
    period: float, by: PlaceBy, seconds: tuple[float, float], away: float, in_place: bool
) -> None:
    course = Course(period)
    during = (course.time >= seconds[0] - 1e-9) & (course.time <= seconds[1])
    if by is PlaceBy.POSE:
        course.rolled[:] = 7.0 * course.time  # which odometry takes for a long way
        course.poses = np.zeros((len(course.time), 4))
        course.poses[during, :2] = away * np.array([0.6, -0.8])  # as far as `away`, neither in x nor in y alone
    else:
        course.rolled[during] = away
    found = course.verdict()
    assert (found.in_place, found.place_by, found.succeeded) == (in_place, by, in_place)
    judged_then = seconds[0] >= 5.0 and seconds[1] <= 10.0
    assert found.farthest == pytest.approx(abs(away) if judged_then else 0.0)
    assert course.verdict(place_radii=2.0).in_place
    assert course.verdict(place_radii=None).in_place is None
    assert course.verdict(place_radii=None).farthest == found.farthest


def test_the_place_is_that_of_the_poses_though_odometry_says_another() -> None:
    course = Course(0.02)
    course.poses = np.zeros((len(course.time), 4))
    course.poses[:, 0] = 0.3
    found = course.verdict()
    assert (found.in_place, found.place_by, found.farthest) == (False, PlaceBy.POSE, 0.3)
    course.poses = None
    found = course.verdict()
    assert (found.in_place, found.place_by, found.farthest) == (True, PlaceBy.ODOMETRY, 0.0)


@pytest.mark.parametrize(("second", "by"), [(1.0, PlaceBy.POSE), (5.0, PlaceBy.ODOMETRY), (10.0, PlaceBy.ODOMETRY)])
def test_a_pose_that_is_unknown_while_the_place_counts_leaves_it_to_odometry(second: float, by: PlaceBy) -> None:
    course = Course(0.02)
    course.rolled[:] = 0.01
    course.rolled[0] = 0.0
    course.poses = np.full((len(course.time), 4), 0.02)
    course.poses[course.at(second)] = np.nan
    found = course.verdict()
    assert (found.in_place, found.place_by) == (True, by)
    assert found.farthest == pytest.approx(0.01 if by is PlaceBy.ODOMETRY else 0.02 * np.sqrt(2))


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize(("share", "quiet"), [(0.0999, True), (0.1001, False)])
def test_commands_must_change_by_less_than_a_tenth_of_the_limit(period: float, share: float, quiet: bool) -> None:
    """A command that goes to and fro by `share` of the limit changes by that at each step."""
    course = Course(period)
    course.commands[:] = 0.5 * share * LIMIT * (-1.0) ** np.arange(len(course.commands))
    course.commands[: course.at(2.0)] *= 10.0  # while it recovers
    found = course.verdict()
    assert found.command_change == pytest.approx(share)
    assert (found.quiet, found.succeeded) == (quiet, quiet)
    assert course.verdict(command_change=0.15).succeeded
    free = course.verdict(command_change=None)
    assert (free.quiet, free.succeeded, free.command_change) == (None, True, found.command_change)


def test_a_steady_or_slowly_changing_command_is_quiet_however_large() -> None:
    course = Course(0.02)
    course.commands[:] = LIMIT * np.sin(course.time[:-1])
    assert course.verdict().command_change == pytest.approx(
        0.02 * np.sqrt(np.mean(np.cos(course.time[101:500]) ** 2)), 0.01
    )
    course.commands[:] = LIMIT
    assert course.verdict().command_change == 0.0


def test_what_is_beyond_the_torque_limit_is_not_sent() -> None:
    course = Course(0.02)
    course.commands[:] = LIMIT * (3.0 + (-1.0) ** np.arange(len(course.commands)))
    assert course.verdict().command_change == 0.0


def test_oscillation_is_from_peak_to_peak_once_it_had_time_to_come_back() -> None:
    course = Course(0.02)
    course.tilt[:] = np.where(course.time < 5.0, 0.1, 0.02 * np.sin(10 * course.time) + 0.01)
    assert course.verdict().oscillation == pytest.approx(0.04, rel=1e-3)


@pytest.mark.parametrize(("second", "degrees", "kept"), [(4.9, 99.0, True), (5.0, 10.1, False), (9.9, 9.9, True)])
@pytest.mark.parametrize("watched", [False, True])
def test_a_controlled_heading_keeps_within_ten_degrees_of_its_reference_from_five_seconds_on(
    second: float, degrees: float, kept: bool, watched: bool
) -> None:
    course = Course(0.02)
    course.headings = np.zeros((len(course.time), 5))
    course.headings[:, [0, 2]] = 1.5  # asked for, and estimated
    if watched:
        course.poses = np.zeros((len(course.time), 4))
        course.poses[:, 2] = 1.5
    told = course.headings[:, 2] if course.poses is None else course.poses[:, 2]
    told[course.at(second)] += np.radians(degrees)
    found = course.verdict()
    assert (found.on_heading, found.succeeded) == (kept, kept)
    assert found.heading_off == pytest.approx(np.radians(degrees) if second >= 5.0 else 0.0)
    assert found.used == pytest.approx(degrees / 10.0 if second >= 5.0 else 0.0)
    assert course.verdict(heading_limit=None).succeeded
    assert course.verdict(heading_limit=None).used == 0.0


def test_a_heading_that_nothing_controls_is_reported_and_not_judged() -> None:
    course = Course(0.02)
    course.poses = np.zeros((len(course.time), 4))
    course.poses[:, 2] = np.linspace(0.0, 1.0, len(course.time))
    found = course.verdict()
    assert (found.on_heading, found.succeeded) == (None, True)
    assert found.heading_off == pytest.approx(course.poses[course.at(10.0), 2])
    course.poses = None
    assert course.verdict().heading_off is None


def test_a_heading_that_turns_round_more_than_once_is_told_without_a_leap() -> None:
    course = Course(0.02)
    course.headings = np.zeros((len(course.time), 5))
    course.headings[:, 0] = course.time
    course.poses = np.zeros((len(course.time), 4))
    course.poses[:, 2] = np.angle(np.exp(1j * course.time))
    assert course.verdict().heading_off == pytest.approx(0.0, abs=1e-9)


def test_a_trial_that_ended_before_says_what_it_can() -> None:
    short = Course(0.02, 3.0).verdict()
    assert short[:4] == (False,) * 4
    assert (short.farthest, short.oscillation, short.seconds) == (None, None, pytest.approx(3.0, abs=0.021))
    assert short.command_change == 0.0
    at_once = Course(0.02, 0.0).verdict()
    assert (at_once.succeeded, at_once.command_change, at_once.seconds) == (False, None, 0.0)


def test_without_data_sheet_and_poses_the_place_is_unknown() -> None:
    found = judged(Course(0.02).episode, SuccessCriterion(0.5, 0.2, 100, 500))
    assert found.succeeded
    assert (found.place_by, found.farthest, found.command_change) == (None, None, None)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"place_radii": 0.0}, "place_radii must be more than 0, or null"),
        ({"command_change": float("nan")}, "command_change must be more than 0, or null"),
        ({"duration": 4.0}, "place_time must lie within the trial; found step 250 of a trial of 200"),
        ({"duration": 1.0}, "settle_time must lie within the trial; found step 100 of a trial of 50"),
        ({"settle_time": 9.99, "duration": 10.0}, "No command changes after step 500"),
        ({"heading_limit": 0.0}, "heading_limit must be more than 0, or null"),
        ({"wheel_radius": None}, "place_radii needs the wheel_radius of the robot"),
        ({"torque_limit": None}, "command_change needs the torque_limit of the robot"),
    ],
)
def test_a_rule_that_asks_for_what_cannot_be_told_is_refused(changes: dict[str, float | None], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        as_a_user_sees_it(0.02, **changes)


def test_a_short_trial_is_allowed_where_the_place_is_not_asked() -> None:
    assert as_a_user_sees_it(0.02, duration=4.0, place_radii=None).steps == 200
