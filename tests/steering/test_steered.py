"""From keys at given times to references and commands, with neither a terminal nor a robot."""

import numpy as np
import pytest
from scripted import PERIOD, Eager, Script, Still

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.episode import Outcome, Provenance
from twbal.core.heading_control import HeadingControl
from twbal.core.plant import Observation
from twbal.core.reference import Reference
from twbal.steering.limits import SteeringLimits
from twbal.steering.request import Key, Sticks
from twbal.steering.steered import SETTLING, SteeredCourse

PLACE = Channels(("tilt", "speed", "position"), 0.15, PERIOD)


@pytest.fixture
def limits(paper):
    return SteeringLimits.from_settings(
        paper, speed_step=0.1, turn=0.5, input_timeout=0.5, hold=False, stick_timeout=2.0
    )


def drive(limits, robot, source, steps, turns=True, **settings):
    """Of a robot that does not move; so drives are short, or the reference gives way to it."""
    course, plant = SteeredCourse(limits, source, **settings), Still()
    heading = HeadingControl(robot, course.headings, True) if turns else None
    told = Provenance("paper", "robot")
    return rollout(plant, Eager(), PLACE, steps, 0.5, told, course, heading, course.watch), course, plant


def followed(course, seconds):
    """Speed, acceleration and yaw rate of the references at each instant, before a robot that is a period behind."""
    along, about = Reference(course), Reference(course.headings)
    rows, times = [], np.arange(0.0, seconds, PERIOD)
    for time in times.tolist():
        along.follow(time, *along.motion[:2])
        about.follow(time, *about.motion[:2])
        rows.append((along.motion.speed, along.motion.acceleration, about.motion.speed, about.motion.acceleration))
    return times, np.array(rows)


@pytest.mark.parametrize("key", [Key.FASTER, Key.LEFT, Sticks(1.0, 1.0)])
@pytest.mark.parametrize("part", [0.01, 0.5, 0.99])
def test_a_key_is_in_the_command_two_control_periods_later_at_most(limits, paper, key, part):
    pressed = (10 + part) * PERIOD
    episode, _, plant = drive(limits, paper, Script((pressed, key)), 20)
    done = np.abs(plant.differences if key is Key.LEFT else episode.commands)
    (late,) = np.flatnonzero(done)[:1] - pressed / PERIOD
    assert 0.0 < late <= 2.0


@pytest.mark.parametrize("seed", range(3))
def test_no_limit_is_passed_however_keys_are_hammered(limits, seed):
    rng = np.random.default_rng(seed)
    hammered = [Key.FASTER, Key.FASTER, Key.SLOWER, Key.LEFT, Key.RIGHT, Key.KEEP, Key.REST]
    whats = [*hammered, Sticks(1.0, -1.0), Sticks(-0.7, 0.3)]
    keys = [(time, whats[rng.integers(len(whats))]) for time in np.sort(rng.uniform(0.1, 20.0, 150)).tolist()]
    _, rows = followed(SteeredCourse(limits, Script(*keys)), 25.0)
    for speeds, changes, most in ((rows[:, 0], rows[:, 1], limits.driving), (rows[:, 2], rows[:, 3], limits.turning)):
        assert np.abs(speeds).max() > 0.1 * most.speed
        assert np.abs(speeds).max() <= most.speed * (1 + 1e-9)
        assert np.abs(np.diff(speeds)).max() <= most.acceleration * PERIOD * (1 + 1e-9)
        assert np.abs(changes).max() <= most.acceleration * (1 + 1e-9)
        assert np.abs(np.diff(changes)).max() <= most.jerk * PERIOD * (1 + 1e-9)


def test_a_stick_that_was_moved_before_the_drive_began_counts_once_it_is_moved_in_it(limits):
    held = Script((0.0, Sticks(1.0, 0.0)), (0.2, Sticks(1.0, -0.02)), (1.0, Sticks(0.5, 0.0)))
    course = SteeredCourse(limits, held)
    asked = [course.target(time).speed / limits.driving.speed for time in (0.0, 0.2, 0.4, 1.0)]
    assert asked == pytest.approx([0.0, 0.0, 0.0, 0.5])


def test_a_held_key_reaches_the_asked_speed_and_silence_brings_the_reference_to_rest(limits):
    held = [(0.1 + 0.03 * n, Key.FASTER if n < 4 else Key.KEEP) for n in range(120)]
    times, rows = followed(SteeredCourse(limits, Script(*held)), 12.0)
    last = held[-1][0]
    assert rows[(times > 2.5) & (times < last + 0.5), 0] == pytest.approx(0.4 * limits.driving.speed)
    begun = times[(times > last) & (rows[:, 1] < 0.0)][0]
    assert last + 0.5 < begun <= last + 0.5 + 3 * PERIOD + 1e-9  # until it is read, noticed, and moves the reference
    assert rows[-1] == pytest.approx(np.zeros(4), abs=1e-9)


def test_keys_for_a_turn_ask_for_a_yaw_rate_for_half_a_second(limits):
    times, rows = followed(SteeredCourse(limits, Script(*((0.1 + 0.1 * n, Key.RIGHT) for n in range(20)))), 6.0)
    assert rows[:, 2].min() == pytest.approx(-0.5 * limits.turning.speed)
    assert rows[times < 0.1, 2] == pytest.approx(0.0) and rows[-1, 2] == pytest.approx(0.0, abs=1e-9)


ENDS = {
    "key": (Script((0.1, Key.FASTER), (0.3, Key.END)), {}, "ended by a key"),
    "loss": (Script((0.1, Key.FASTER), lost_at=0.3), {}, "the script was lost"),
    "time": (Script((0.1, Key.FASTER)), {"seconds": 0.3}, "0.3 s were over"),
}


@pytest.mark.parametrize("end", ENDS)
def test_the_end_is_a_ramp_to_rest_and_a_completed_episode(limits, paper, end):
    source, settings, why = ENDS[end]
    episode, course, _ = drive(limits, paper, source, 10_000, **settings)
    assert episode.outcome is Outcome.COMPLETED
    assert [event.text for event in episode.events] == [f"{why}, and the reference came to rest"]
    assert [event.text for event in course.events] == [f"{why}: the reference goes to rest"]
    speeds, times = episode.references[:, 1], episode.observations[:, 0]
    assert speeds.max() > 0.0 and (speeds[times >= times[-1] - SETTLING + PERIOD / 2] == pytest.approx(0.0, abs=1e-9))
    assert episode.duration < 0.3 + 3.0 + SETTLING


def test_a_stop_ends_at_the_observation_at_which_it_is_read(limits, paper):
    episode, _, _ = drive(limits, paper, Script((0.1, Key.FASTER), (0.3, Key.STOP)), 10_000)
    assert episode.outcome is Outcome.STOPPED and episode.events[-1].text == "stopped by a key"
    assert episode.duration == pytest.approx(0.3, abs=PERIOD)


def test_what_was_pressed_before_the_drive_is_not_for_the_robot_but_a_stop(limits, paper):
    early, _, _ = drive(limits, paper, Script((0.0, Key.FASTER)), 20)
    assert not early.references.any()
    stopped, _, _ = drive(limits, paper, Script((0.0, Key.STOP)), 20)
    assert stopped.outcome is Outcome.STOPPED and not len(stopped.commands)


def test_input_is_read_once_a_period_after_the_wait_for_it(limits):
    order = []

    class Noted(Script):
        def read(self, time):
            order.append(("read", time))
            return super().read(time)

    course = SteeredCourse(limits, Noted(), before_reading=lambda time: order.append(("wait", time)))
    Reference(course).follow(0.1, 0.0, 0.0)
    Reference(course.headings).follow(0.1, 0.0, 0.0)
    assert order == [("wait", 0.1), ("read", 0.1)]


def test_a_robot_that_is_held_makes_the_steered_reference_give_way(limits, paper):
    held = [(0.03 * n, Key.FASTER) for n in range(1, 200)]
    episode, _, _ = drive(limits, paper, Script(*held), 300, turns=False)
    assert episode.references[:, 0].max() <= limits.give_way + 1e-9
    assert "the reference gives way" in [event.text for event in episode.events]


def test_watching_shows_each_moment(limits):
    shown = []
    course = SteeredCourse(limits, Script((0.02, Key.FASTER)), show=shown.append)
    reference = Reference(course)
    for time in (0.0, 0.02):
        assert course.watch(Observation(time, *(0.0,) * 6), reference.follow(time, 0.0, 0.0), None, 0.0) is None
    assert [moment.asked.speed for moment in shown] == [0.0, 0.1]
