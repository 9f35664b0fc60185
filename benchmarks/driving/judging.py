"""What a robot did, by its true poses alone: nothing here asks where twbal believes that it is."""

from collections.abc import Sequence
from math import degrees
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.course import Segment
from twbal.core.gaussian import Array
from twbal.core.plant import Pose

STEADY_TIME = 8.0
"""At the end of a ramp, over which the speed is averaged [s]. The ground has waves of up to 3 m, and a robot at 0.3 m/s
rolls 2.4 m in that time. Over 4 s a single uneven place at the end could decide whether a speed was right."""
STOOD_TIME = 1.0  # at the end of standing, in which the heading is looked at [s]
PLACE_TIME = 5.0  # from which on a place is to be kept; that of the rule of success [s]
SPEED_ERROR = 5.0  # [per cent]
HEADING_ERROR = 3.0  # [deg]
SQUARE_RADII = 1.0  # 0.15 m of `paper`'s wheels [wheel radii]
PLACE_RADII = 2.0  # [wheel radii]
_HEADING, _TILT = Pose._fields.index("heading"), Pose._fields.index("tilt")


class Driven(NamedTuple):
    """A rollout as it truly was.

    Attributes:
        times: (T + 1,) [s].
        poses: (T + 1, 4) rows of `Pose`.
        segments: of the course.
        tilt_limit: [rad].
    """

    times: Array
    poses: Array
    segments: Sequence[Segment]
    tilt_limit: float

    @property
    def stood_up(self) -> bool:
        """Whether it went on to the end, and never leaned beyond the limit."""
        complete = bool(self.times[-1] >= self.segments[-1].end - 1e-6)
        return complete and bool(np.abs(self.poses[:, _TILT]).max() <= self.tilt_limit)

    @property
    def headings(self) -> Array:
        """(T + 1,) from the start on, without jumps [rad]."""
        return np.unwrap(self.poses[:, _HEADING])

    @property
    def way(self) -> Array:
        """(T + 1,) how far it drove, forward less backward [m]."""
        x, y, heading, _ = self.poses.T
        middle = 0.5 * (heading[1:] + heading[:-1])
        return np.concatenate([[0.0], np.cumsum(np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle))])

    def during(self, begin: float, end: float) -> NDArray[np.bool_]:
        """(T + 1,) whether an instant is between two times [s]."""
        return (self.times >= begin - 1e-9) & (self.times <= end + 1e-9)


def speed_errors(driven: Driven) -> list[float]:
    """Of the mean speed in the last seconds of each segment with one, in per cent of what was asked for."""
    found, way = [], driven.way
    for segment in driven.segments:
        asked = segment.target.speed
        if asked:
            late = np.flatnonzero(driven.during(segment.end - STEADY_TIME, segment.end))
            first, last = late[0], late[-1]
            speed = (way[last] - way[first]) / (driven.times[last] - driven.times[first])
            found.append(float(100.0 * (speed / asked - 1.0)))
    return found


def heading_errors(driven: Driven) -> list[float]:
    """The worst heading in the last second of each time of standing that follows a turn [deg]."""
    found, before = [], 0.0
    for segment, following in zip(driven.segments, driven.segments[1:], strict=False):
        if segment.target.heading != before:
            before = segment.target.heading
            late = driven.during(following.end - STOOD_TIME, following.end)
            found.append(degrees(float(np.abs(driven.headings[late] - before).max())))
    return found


def from_start(driven: Driven) -> float:
    """How far in the plane from where it was put it ends [m]."""
    return float(np.hypot(*driven.poses[-1, :2]))


def farthest(driven: Driven) -> float:
    """From where it is to stand, from 5 s on, as long as it is to stand there; the first second is left for stopping.

    A place that was asked for is to be kept in the time of standing after it.
    """
    away, place = [0.0], 0.0
    for segment in driven.segments:
        if segment.target.speed is None:
            place = segment.target.position
            continue
        standing = driven.during(max(segment.begin + STOOD_TIME, PLACE_TIME), segment.end)
        away.append(float(np.abs(driven.way[standing] - place).max(initial=0.0)))
    return max(away)


def passed(name: str, measured: Sequence[float], wheel_radius: float) -> bool:
    """Whether a rollout in which nothing fell did what was asked.

    Args:
        name: of the task.
        measured: what `measured_of` said.
        wheel_radius: of the data sheet [m].
    """
    limits = {
        "ramp": SPEED_ERROR,
        "turns": HEADING_ERROR,
        "square": SQUARE_RADII * wheel_radius,
        "slope": PLACE_RADII * wheel_radius,
    }
    return name == "push" or max(map(abs, measured)) <= limits[name]


def measured_of(name: str, driven: Driven) -> list[float]:
    """What a task is judged by, of a rollout that came to its end: per cent, degrees or m."""
    match name:
        case "ramp" | "push":
            return speed_errors(driven)
        case "turns":
            return heading_errors(driven)
        case "square":
            return [from_start(driven)]
        case _:
            return [farthest(driven)]
