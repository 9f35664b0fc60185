"""How well a robot followed a course."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twbal.core.channels import Channels
from twbal.core.course import Course, Segment
from twbal.core.episode import Episode, Outcome
from twbal.core.evaluation import PlaceBy
from twbal.core.gaussian import Array
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation, Pose
from twbal.core.reference import Reference

_TIME, _POSITION = Observation._fields.index("time"), Motion._fields.index("position")
_SPEED = Motion._fields.index("speed")
_HEADING = Pose._fields.index("heading")
HEADING_TIME = 5.0
"""From which on the heading is judged; it is that of the rule of success [s]."""
_STEADY = 1e-9  # of a speed [m/s]
_EVERY = 0.05  # s, at which a course's way is looked at


@dataclass(frozen=True)
class FollowedSegment:
    """What the robot did in a segment of a course.

    Attributes:
        begin: [s].
        end: [s].
        asked_speed: [m/s]; None where a place was asked for.
        asked_position: [m]; None where a speed was asked for.
        speed: of the robot, mean over the second half of the time in which the reference had the asked speed [m/s];
            None where it never had, or where a place was asked for.
        speed_error: of that speed, in per cent of the asked one; None where that is none or 0.
        farthest: greatest distance from the reference [m].
        off_at_end: distance from the reference at the end, forward being positive [m].
        asked_heading: [rad]; None where nothing controlled it.
        heading_off_at_end: heading less that of the reference at the end [rad]; None where nothing controlled it.
    """

    begin: float
    end: float
    asked_speed: float | None
    asked_position: float | None
    speed: float | None
    speed_error: float | None
    farthest: float
    off_at_end: float
    asked_heading: float | None = None
    heading_off_at_end: float | None = None


@dataclass(frozen=True)
class FollowedCourse:
    """What the robot did in a trial.

    Attributes:
        trial: its number.
        outcome: how it ended.
        fell: whether that was by the tilt limit.
        seconds: how long it lasted [s].
        place_by: what told where the robot was.
        turned: heading at the end [rad]; None where no poses tell it.
        gave_way: how often the reference gave way.
        heading_error: most by which the heading was off that of its reference from 5 s on [rad], by true poses where
            there are any, else by the robot's own estimate; None where nothing controlled it, or the trial was shorter.
        from_start: distance in the plane from where the robot was put, at the end [m]; None where no poses tell it.
        segments: in which a sample falls: none after the end, none that is much shorter than a control period.
    """

    trial: int
    outcome: Outcome
    fell: bool
    seconds: float
    place_by: PlaceBy
    turned: float | None
    gave_way: int
    segments: tuple[FollowedSegment, ...]
    heading_error: float | None = None
    from_start: float | None = None


@dataclass(frozen=True)
class CourseRecord:
    """What `real-rollout` writes of a course.

    Attributes:
        trials: what the robot did in each.
    """

    trials: tuple[FollowedCourse, ...]


@dataclass(frozen=True)
class FloorNeeded:
    """How far a reference goes from where the robot was put.

    Attributes:
        ahead: [m].
        behind: [m].
        left: [m].
        right: [m].
    """

    ahead: float
    behind: float
    left: float = 0.0
    right: float = 0.0


def floor_needed(course: Course) -> FloorNeeded:
    """How far the course goes where its reference never gives way."""
    times = np.arange(0.0, course.duration + _EVERY, _EVERY)
    way = _path(Reference(course), times)
    headings = _path(Reference(course.heading), times) if course.heading else np.zeros_like(way)
    steps, middle = np.diff(way, prepend=0.0), 0.5 * (headings + np.append(0.0, headings[:-1]))
    x, y = np.cumsum(steps * np.cos(middle)), np.cumsum(steps * np.sin(middle))
    return FloorNeeded(*(0.0 + max(float(side.max()), 0.0) for side in (x, -x, y, -y)))


def _path(reference: Reference, times: Array) -> Array:
    """Where a reference goes that a robot follows a step behind, which is near enough."""
    return np.array([reference.follow(time, *reference.motion[:2]).position for time in times.tolist()])


def followed(episode: Episode, course: Course, wheel_radius: float) -> FollowedCourse:
    """What the robot did on a course, by true poses where each sample has one, else by odometry.

    Places are those along the robot's own way, whichever way it looks.

    Args:
        episode: a trial that followed the course's reference.
        course: that was asked for.
        wheel_radius: of the data sheet [m].
    """
    assert episode.references is not None
    poses = episode.poses if episode.poses is not None and np.isfinite(episode.poses).all() else None
    places = _rolled(episode.observations, wheel_radius) if poses is None else _way(poses)
    times = episode.observations[:, _TIME]
    off = None if episode.headings is None else episode.heading_errors
    late = np.empty(0) if off is None else np.abs(off[times >= HEADING_TIME])
    driven = [segment for segment in course.segments if _within(segment, times).any()]
    return FollowedCourse(
        trial=episode.provenance.trial,
        outcome=episode.outcome,
        fell=episode.outcome is Outcome.TILT_LIMIT,
        seconds=episode.duration,
        place_by=PlaceBy.ODOMETRY if poses is None else PlaceBy.POSE,
        turned=None if poses is None else float(poses[-1, _HEADING]),
        gave_way=sum("gives way" in event.text for event in episode.events),
        segments=tuple(_segment(segment, times, places, episode.references, off) for segment in driven),
        heading_error=float(late.max()) if len(late) else None,
        from_start=None if poses is None else float(np.hypot(*poses[-1, :2])),
    )


def _rolled(observations: Array, wheel_radius: float) -> Array:
    """Distance by odometry, (T + 1,) [m]."""
    path = Channels(("speed",), wheel_radius).path(Observation(*observations.T))
    return np.asarray(path - path[0])


def _way(poses: Array) -> Array:
    """Distance along the way, forward being positive, (T + 1,) [m]."""
    x, y, heading, _ = poses.T
    middle = 0.5 * (heading[1:] + heading[:-1])
    return np.concatenate([[0.0], np.cumsum(np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle))])


def _within(segment: Segment, times: Array) -> NDArray[np.bool_]:
    """Which samples fall into a segment; none, where it is shorter than a control period."""
    return np.asarray((times >= segment.begin) & (times <= segment.end))


def _segment(segment: Segment, times: Array, places: Array, references: Array, off: Array | None) -> FollowedSegment:
    part = _within(segment, times)
    away = places[part] - references[part, _POSITION]
    asked = segment.target.speed
    speed = None if asked is None else _steady_speed(asked, times[part], places[part], references[part, _SPEED])
    return FollowedSegment(
        begin=segment.begin,
        end=segment.end,
        asked_speed=asked,
        asked_position=segment.target.position if asked is None else None,
        speed=speed,
        speed_error=100.0 * (speed / asked - 1.0) if asked and speed is not None else None,
        farthest=float(np.abs(away).max()),
        off_at_end=float(away[-1]),
        asked_heading=None if off is None else segment.target.heading,
        heading_off_at_end=None if off is None else float(off[part][-1]),
    )


def _steady_speed(asked: float, times: Array, places: Array, speeds: Array) -> float | None:
    steady = np.flatnonzero(np.abs(speeds - asked) < _STEADY)
    late = steady[len(steady) // 2 :]
    return float((places[late[-1]] - places[late[0]]) / (times[late[-1]] - times[late[0]])) if len(late) > 1 else None
