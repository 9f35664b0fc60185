from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from twbal.algorithm.following import followed
from twbal.core.course import Course, Segment, Target
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import DataError
from twbal.core.motion_limits import MotionLimits

STEPS = 4


def parts(**changes):
    observations = np.random.default_rng(0).standard_normal((STEPS + 1, 7))
    observations[:, 0] = 0.02 * np.arange(STEPS + 1)
    values = {
        "channels": ("tilt", "speed"),
        "control_period": 0.02,
        "observations": observations,
        "states": np.ones((STEPS + 1, 2)),
        "commands": np.zeros(STEPS),
        "outcome": Outcome.COMPLETED,
        "provenance": Provenance("paper", "simulation"),
    }
    return values | changes


def test_an_episode_knows_its_length_duration_and_tilt():
    made = Episode(**parts())
    assert len(made) == STEPS
    assert made.duration == pytest.approx(0.08)
    assert np.array_equal(made.tilt, made.observations[:, 1])


def test_an_episode_with_missed_periods_lasts_as_long_as_its_clock_says():
    observations = parts()["observations"].copy()
    observations[3:, 0] += 0.06  # three periods without a command
    assert Episode(**parts(observations=observations)).duration == pytest.approx(0.14)
    observations[3:, 0] -= 0.055  # late by a quarter of a period
    assert Episode(**parts(observations=observations)).duration == pytest.approx(0.08)


def test_what_is_in_it_cannot_be_changed():
    given = parts()
    made = Episode(**given)
    with pytest.raises(ValueError, match="read-only"):
        made.states[0, 0] = 3.0
    with pytest.raises(FrozenInstanceError):
        made.outcome = Outcome.STOPPED
    given["states"][0, 0] = 9.0
    assert made.states[0, 0] == 1.0


def test_an_outcome_may_come_as_text():
    assert Episode(**parts(outcome="tilt_limit")).outcome is Outcome.TILT_LIMIT


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("observations", np.zeros((STEPS, 7))),
        ("observations", np.zeros((STEPS + 1, 6))),
        ("states", np.ones((STEPS + 1, 3))),
        ("states", np.ones(STEPS + 1)),
    ],
)
def test_shapes_that_do_not_fit_are_refused(name, values):
    with pytest.raises(DataError, match=f"4 commands needs {name} of shape"):
        Episode(**parts(**{name: values}))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["observations", "states", "commands"])
def test_a_value_that_is_not_finite_is_named_by_its_sample(name, bad):
    values = np.array(parts()[name])
    values[2] = bad
    with pytest.raises(DataError, match=f"Sample 2 of the episode's {name} is not a finite number"):
        Episode(**parts(**{name: values}))


@pytest.mark.parametrize("time", [0.02, 0.01])
def test_time_that_stands_or_runs_back_is_refused(time):
    observations = parts()["observations"]
    observations[2, 0] = time
    with pytest.raises(DataError, match="between samples 1 and 2"):
        Episode(**parts(observations=observations))


@pytest.mark.parametrize("period", [0.0, -0.02, float("nan")])
def test_the_control_period_must_be_positive(period):
    with pytest.raises(DataError, match="control period must be positive"):
        Episode(**parts(control_period=period))


def test_a_rollout_that_ended_at_once_is_an_episode_too():
    made = Episode(**parts(observations=np.zeros((1, 7)), states=np.zeros((1, 2)), commands=np.zeros(0)))
    assert (len(made), made.duration) == (0, 0.0)


def test_poses_are_kept_with_gaps_where_nothing_told_them():
    poses = 0.1 * np.arange(4.0 * (STEPS + 1)).reshape(-1, 4)
    poses[2] = np.nan
    made = Episode(**parts(poses=poses))
    np.testing.assert_array_equal(made.poses, poses)
    poses[0] = 9.0
    assert made.poses[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        made.poses[0, 0] = 3.0
    assert Episode(**parts()).poses is None


@pytest.mark.parametrize("missing", [False, True])
def test_the_heading_of_a_robot_that_turns_round_runs_on_beyond_half_a_turn(missing):
    poses, truth = np.zeros((STEPS + 1, 4)), np.array([0.0, 2.5, 3.5, 4.5, 6.8])
    poses[:, 2] = np.arctan2(np.sin(truth), np.cos(truth))  # as engines tell it
    if missing:
        poses[2], truth[2] = np.nan, np.nan
    np.testing.assert_allclose(Episode(**parts(poses=poses)).poses[:, 2], truth)


def test_the_way_of_a_robot_that_drives_back_is_as_long_as_it_was():
    """It sways by a degree about half a turn, so the heading that engines tell jumps by a turn again and again."""
    time = 0.02 * np.arange(251)
    heading = np.pi + np.radians(1.0) * np.sin(2.0 * np.pi * 1.5 * time)
    x, y = (np.cumsum(0.01 * side) for side in (np.cos(heading), np.sin(heading)))
    poses = np.column_stack([x, y, np.arctan2(np.sin(heading), np.cos(heading)), 0.0 * time])
    observations = np.column_stack([time, np.zeros((251, 6))])
    states, still = np.zeros((251, 2)), np.column_stack([0.5 * time, np.full(251, 0.5), 0.0 * time])
    given = parts(observations=observations, states=states, commands=np.zeros(250), poses=poses, references=still)
    course = Course((Segment(Target(0.5), 0.0, 5.0),), MotionLimits(1.0, 1.0, 1.0), 0.3)
    (segment,) = followed(Episode(**given), course, 0.15).segments
    assert segment.speed == pytest.approx(0.5, rel=1e-3)
    assert segment.off_at_end == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("shape", [(STEPS, 4), (STEPS + 1, 3), (STEPS + 1,)])
def test_poses_that_are_not_one_for_each_sample_are_refused(shape):
    with pytest.raises(DataError, match=r"4 commands needs poses of shape \(5, 4\); found"):
        Episode(**parts(poses=np.zeros(shape)))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_pose_that_is_known_in_part_is_refused(value):
    poses = np.zeros((STEPS + 1, 4))
    poses[3, 1] = value
    with pytest.raises(DataError, match="Pose 3 of the episode is neither known nor unknown"):
        Episode(**parts(poses=poses))


def test_over_ground_the_reference_is_added_back_to_position_and_speed_alone():
    rng = np.random.default_rng(2)
    states, references = rng.standard_normal((STEPS + 1, 3)), rng.standard_normal((STEPS + 1, 3))
    made = Episode(**parts(channels=("speed", "tilt", "position"), states=states, references=references))
    ground = made.over_ground()
    added = np.column_stack([references[:, 1], np.zeros(STEPS + 1), references[:, 0]])
    np.testing.assert_allclose(ground.states, states + added)
    assert ground.references is None and ground.over_ground() is ground
    np.testing.assert_array_equal(made.states, states)


@pytest.mark.parametrize("shape", [(4, 3), (5, 2)])
def test_references_that_are_not_one_for_each_sample_are_refused(shape):
    with pytest.raises(DataError, match=r"4 commands needs references of shape \(5, 3\); found"):
        Episode(**parts(references=np.zeros(shape)))


def test_a_reference_that_is_no_number_is_refused():
    references = np.zeros((STEPS + 1, 3))
    references[2, 1] = np.nan
    with pytest.raises(DataError, match="Sample 2 of the episode's references is not a finite number"):
        Episode(**parts(references=references))


@pytest.mark.parametrize("shape", [(4, 5), (5, 3)])
def test_headings_that_are_not_one_for_each_sample_are_refused(shape):
    with pytest.raises(DataError, match=r"4 commands needs headings of shape \(5, 5\); found"):
        Episode(**parts(headings=np.zeros(shape)))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"outcome": "foo"}, "outcome of an episode must be one of completed, tilt_limit, .*; found 'foo'"),
        ({"outcome": None}, "outcome of an episode must be one of .*; found None"),
        ({"control_period": "0.02"}, "control period must be a number, in s; found '0.02'"),
        ({"control_period": None}, "control period must be a number, in s; found None"),
        ({"provenance": None}, "provenance of an episode must be a Provenance, .*; found None"),
        ({"channels": "tilt"}, "channels of an episode must be names of channels, .*; found 'tilt'"),
        ({"channels": 3}, "channels of an episode must be names of channels, .*; found 3"),
        ({"channels": ("tilt", 2)}, "must be names of channels"),
        ({"commands": ["1"] * STEPS}, "commands of an episode must be numbers; found an array of <U1"),
        ({"commands": np.array(["1"] * STEPS, dtype=object)}, "commands of an episode must be numbers"),
        ({"commands": None}, "commands of an episode must be "),
        ({"commands": 3.0}, "commands of an episode must be an array of numbers; found 3"),
        ({"states": [[1.0, 2.0], [3.0]]}, "states of an episode must be numbers, in rows of one length"),
        ({"poses": [["x"] * 4] * (STEPS + 1)}, "poses of an episode must be numbers"),
    ],
)
def test_a_part_that_is_not_of_its_type_is_refused(changes, said):
    with pytest.raises(DataError, match=said):
        Episode(**parts(**changes))


def test_numbers_of_any_kind_become_an_array_of_its_own():
    made = Episode(**parts(commands=[0, 1, 2, 3], control_period=np.float32(0.02), states=np.ones((STEPS + 1, 2), int)))
    assert made.commands.dtype == made.states.dtype == np.float64
