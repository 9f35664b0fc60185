"""The record of one rollout, checked when it is made and never changed after."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from numbers import Real
from typing import NamedTuple

import numpy as np

from twbal.core.errors import DataError
from twbal.core.gaussian import Array
from twbal.core.heading import HeadingSample
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation, Pose


class Outcome(StrEnum):
    """How a rollout ended."""

    COMPLETED = "completed"
    TILT_LIMIT = "tilt_limit"
    STOPPED = "stopped"  # by a person
    LINK_LOST = "link_lost"  # the robot fell silent, stopped itself, or sent what cannot be
    POLICY_FAULT = "policy_fault"  # the policy commanded what is no number


class Event(NamedTuple):
    """Something that happened in a rollout.

    Attributes:
        time: since the rollout began [s].
        text: what happened.
    """

    time: float
    text: str


def in_sentences(events: Iterable[Event]) -> str:
    """Texts of events, one sentence each."""
    texts = [event.text[:1].upper() + event.text[1:] for event in events]
    return " ".join(text if text.endswith((".", "?", "!")) else f"{text}." for text in texts)


class Ending(NamedTuple):
    """How somebody ends a rollout.

    Attributes:
        outcome: as which it ends.
        text: why.
    """

    outcome: Outcome
    text: str


@dataclass(frozen=True)
class Provenance:
    """Where an episode comes from, as far as it bears on what is in it (no wall-clock times).

    Attributes:
        robot: name of the robot ("paper", "regbot", or what the link's handshake said).
        source: "simulation" or "robot".
        parameter_hash: of the parameters (and effects) it was simulated with, or of the data sheet.
        policy_hash: of the policy that drove it.
        seed: of the stage that recorded it.
        trial: number of the rollout within that stage.
        config: the resolved configuration of that stage, as yaml text.
    """

    robot: str
    source: str
    parameter_hash: str = ""
    policy_hash: str = ""
    seed: int = 0
    trial: int = 0
    config: str = ""


class Estimated(NamedTuple):
    """A channel of the observations that no sensor measured.

    Attributes:
        channel: its name, of `Observation`.
        sd: standard deviation by which what stands there may be off, in the channel's unit.
    """

    channel: str
    sd: float


def _numbers(name: str, values: object) -> Array:
    """A copy of the numbers of a part of an episode; text is none.

    Raises:
        DataError: they are no numbers, or rows are not of one length.
    """
    try:
        found = np.array(values)
        if found.dtype.kind not in "biufO" or any(isinstance(each, str | bytes) for each in _objects(found)):
            raise DataError(f"The {name} of an episode must be numbers; found an array of {found.dtype}.")
        if not found.ndim:
            raise DataError(f"The {name} of an episode must be an array of numbers; found {values!r:.80}.")
        return found.astype(np.float64, copy=False)
    except (TypeError, ValueError) as error:
        raise DataError(f"The {name} of an episode must be numbers, in rows of one length: {error}.") from error


def _objects(values: Array) -> Iterable[object]:
    """The elements of an array of Python's objects; none of other arrays."""
    return values.ravel().tolist() if values.dtype.kind == "O" else ()


@dataclass(frozen=True, eq=False)
class Episode:
    """T control periods of a robot.

    Attributes:
        channels: names of the D state channels.
        control_period: [s].
        observations: (T + 1, 7) in the order of `Observation`.
        states: (T + 1, D), the state x_t made from observation t and the commands before it.
        commands: (T,) [N·m]; commands[t] acted between observations t and t + 1.
        outcome: how it ended.
        provenance: where it comes from.
        events: what happened on the way.
        estimated: channels that were worked out from others, in logs of robots that lack a sensor.
        references: (T + 1, 3) the reference that the robot followed, in the order of `Motion`; None where it was to
            stay where it was put. Position and speed among the states are less those of the reference.
        headings: (T + 1, 5) what the control of the heading knew and did, in the order of `HeadingSample`; None where
            nothing controlled it.
        poses: (T + 1, 4) true poses in the order of `Pose`, where something told them; a row is NaN where nothing did
            at that instant. They serve to judge what the robot did. Policies and models never see them. Headings that
            were told within a turn, as engines and cameras do, run on beyond ±π.

    Raises:
        DataError: a part is not of its type, shapes do not fit together, a value is not finite, or time does not run
            forward.
    """

    channels: tuple[str, ...]
    control_period: float
    observations: Array
    states: Array
    commands: Array
    outcome: Outcome
    provenance: Provenance
    events: tuple[Event, ...] = field(default=())
    estimated: tuple[Estimated, ...] = field(default=())
    poses: Array | None = None
    references: Array | None = None
    headings: Array | None = None

    def __post_init__(self) -> None:
        self._check_types()
        optional = tuple(name for name in ("references", "headings") if getattr(self, name) is not None)
        given = ("observations", "states", "commands", *optional)
        for name in given:
            values = _numbers(name, getattr(self, name))
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        self._check_poses()
        object.__setattr__(self, "channels", tuple(self.channels))
        for channel, sd in self.estimated:
            if channel not in Observation._fields or not sd >= 0:  # infinite: nothing is known of it
                raise DataError(f"An episode has no channel {channel!r} estimated to {sd}.")
        steps = len(self.commands)
        expected = {
            "observations": (steps + 1, len(Observation._fields)),
            "states": (steps + 1, len(self.channels)),
            "commands": (steps,),
            "references": (steps + 1, len(Motion._fields)),
            "headings": (steps + 1, len(HeadingSample._fields)),
        }
        for name in given:
            values, shape = getattr(self, name), expected[name]
            if values.shape != shape:
                raise DataError(f"An episode of {steps} commands needs {name} of shape {shape}; found {values.shape}.")
            if not np.isfinite(values).all():
                row = int(np.argwhere(~np.isfinite(values))[0][0])
                raise DataError(
                    f"Sample {row} of the episode's {name} is not a finite number "
                    f"({np.asarray(values[row]).tolist()}). "
                    "Leave that episode out, or mend what recorded it."
                )
        if not 0 < self.control_period < np.inf:
            raise DataError(f"The control period must be positive and finite; found {self.control_period} s.")
        if steps and np.diff(self.observations[:, 0]).min() <= 0:
            row = int(np.argmin(np.diff(self.observations[:, 0])))
            raise DataError(f"Time does not run forward between samples {row} and {row + 1} of the episode.")

    def _check_types(self) -> None:
        """Check all that is no array, and make the outcome one.

        Raises:
            DataError: a part is not of its type.
        """
        channels: object = self.channels
        names = tuple(channels) if isinstance(channels, Iterable) and not isinstance(channels, str) else (channels,)
        if isinstance(channels, str) or not all(isinstance(name, str) for name in names):
            raise DataError(
                "The channels of an episode must be names of channels, such as ('tilt', 'tilt_rate'); found "
                f"{channels!r:.80}."
            )
        period: object = self.control_period
        if isinstance(period, bool) or not isinstance(period, Real):
            raise DataError(f"The control period must be a number, in s; found {period!r:.80}.")
        if not isinstance(self.provenance, Provenance):
            raise DataError(
                "The provenance of an episode must be a Provenance, such as Provenance('my_robot', 'robot'); found "
                f"{self.provenance!r:.80}."
            )
        if self.outcome not in list(Outcome):
            raise DataError(
                f"The outcome of an episode must be one of {', '.join(Outcome)}; found {self.outcome!r:.80}."
            )
        object.__setattr__(self, "outcome", Outcome(self.outcome))

    def _check_poses(self) -> None:
        """Check the poses and make them a constant of their own.

        Raises:
            DataError: they are not one for each sample, or a row is neither all numbers nor all NaN.
        """
        if self.poses is None:
            return
        poses = _numbers("poses", self.poses)
        expected = len(self.commands) + 1, len(Pose._fields)
        if poses.shape != expected:
            raise DataError(
                f"An episode of {expected[0] - 1} commands needs poses of shape {expected}; found {poses.shape}."
            )
        broken = np.flatnonzero(~(np.isfinite(poses).all(axis=1) | np.isnan(poses).all(axis=1)))
        if len(broken):
            raise DataError(
                f"Pose {broken[0]} of the episode is neither known nor unknown ({poses[broken[0]]}); expected numbers, "
                "or NaN in all of its fields."
            )
        known, heading = np.isfinite(poses).all(axis=1), Pose._fields.index("heading")
        poses[known, heading] = np.unwrap(poses[known, heading])
        poses.flags.writeable = False
        object.__setattr__(self, "poses", poses)

    def __len__(self) -> int:
        return len(self.commands)

    @property
    def duration(self) -> float:
        """How long the robot was driven: its control periods, or by its clock where it missed some of them [s]."""
        nominal = len(self) * self.control_period
        times = self.observations[:, Observation._fields.index("time")]
        elapsed = float(times[-1] - times[0])
        return elapsed if elapsed > nominal + 0.5 * self.control_period else nominal

    @property
    def tilt(self) -> Array:
        """Measured tilt at each control instant, (T + 1,) [rad]."""
        return self.observations[:, Observation._fields.index("tilt")]

    @property
    def heading_errors(self) -> Array | None:
        """Heading less that of its reference, (T + 1,) [rad], by true poses where all are known, else by the estimate.

        Where nothing controlled it the reference is the heading with which the robot was put. None where neither is
        known.
        """
        heading = None if self.headings is None else HeadingSample(*self.headings.T)
        asked = 0.0 if heading is None else heading.reference
        if self.poses is not None and np.isfinite(self.poses).all():
            return np.asarray(self.poses[:, Pose._fields.index("heading")] - asked)
        return None if heading is None else np.asarray(heading.estimate - asked)

    def over_ground(self) -> "Episode":
        """The episode with states that are not relative to a reference: what the robot does depends on these.

        The position's integral stays that of what the policy saw.
        """
        if self.references is None:
            return self
        states = self.states.copy()
        for name in {"position", "speed"} & set(self.channels):
            states[:, self.channels.index(name)] += self.references[:, Motion._fields.index(name)]
        return replace(self, states=states, references=None)
