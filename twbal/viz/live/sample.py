"""What a live view is told of an instant of a drive, as bytes of one length."""

import struct
from math import nan
from typing import NamedTuple

import numpy as np

from twbal.core.channels import Channels
from twbal.core.episode import Episode
from twbal.core.gaussian import Array
from twbal.core.heading import HeadingSample
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation


class Sample(NamedTuple):
    """An instant of a drive; NaN where nothing is known.

    Attributes:
        time: since the drive began [s].
        tilt: of the body [rad].
        wheel: mean angle of the wheels over ground, since the drive began [rad].
        place: along the robot's way, by its wheels [m].
        reference_place: [m].
        speed: by its wheels [m/s].
        reference_speed: [m/s].
        asked_speed: by the person [m/s].
        heading: by its sensors [rad].
        reference_heading: [rad].
        command: that acted until then [N·m].
    """

    time: float
    tilt: float
    wheel: float
    place: float
    reference_place: float
    speed: float
    reference_speed: float
    asked_speed: float
    heading: float
    reference_heading: float
    command: float


_LAYOUT = struct.Struct(f"<{len(Sample._fields)}d")
SIZE = _LAYOUT.size
"""Of a sample [bytes]."""


def encoded(sample: Sample) -> bytes:
    """The bytes of a sample."""
    return _LAYOUT.pack(*sample)


def decoded(data: bytes) -> Array:
    """Samples, (N, 11), of N·`SIZE` bytes."""
    return np.frombuffer(data, dtype="<f8").reshape(-1, len(Sample._fields))


class Sampler:
    """Makes samples of what a drive shows.

    Args:
        wheel_radius: of the data sheet [m].
    """

    def __init__(self, wheel_radius: float) -> None:
        self._radius, self._channels = wheel_radius, Channels(("speed",), wheel_radius)
        self._start: float | None = None  # of the path [m]

    def sample(
        self, seen: Observation, reference: Motion, heading: HeadingSample | None, command: float, asked: float = nan
    ) -> Sample:
        """The sample of an instant.

        Args:
            seen: by the sensors.
            reference: along the way.
            heading: what its control knows; None where nothing controls it.
            command: that acted until then [N·m].
            asked: speed that a person asks for [m/s].
        """
        path = float(self._channels.path(seen))
        self._start = path if self._start is None else self._start
        place = path - self._start
        return Sample(
            time=seen.time,
            tilt=seen.tilt,
            wheel=place / self._radius,
            place=place,
            reference_place=reference.position,
            speed=self._radius * (seen.wheel_rate + seen.tilt_rate),
            reference_speed=reference.speed,
            asked_speed=asked,
            heading=nan if heading is None else heading.estimate,
            reference_heading=nan if heading is None else heading.reference,
            command=command,
        )


def samples_of(episode: Episode, wheel_radius: float) -> Array:
    """Samples of an episode, (T + 1, 11); one without a reference was to stay where it was put."""
    sampler = Sampler(wheel_radius)
    made = []
    for number, row in enumerate(episode.observations):
        reference = Motion() if episode.references is None else Motion(*episode.references[number])
        heading = None if episode.headings is None else HeadingSample(*episode.headings[number])
        command = float(episode.commands[number - 1]) if number else 0.0
        made.append(sampler.sample(Observation(*row), reference, heading, command))
    return np.array(made)
