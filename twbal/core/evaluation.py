"""What real trials say about a policy: whether it did what is asked, and at what cost."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import ceil, inf
from typing import NamedTuple, Self

import numpy as np

from twbal.core.episode import Episode, Outcome
from twbal.core.errors import ConfigError, DataError
from twbal.core.gaussian import Array
from twbal.core.plant import Observation

StateCost = Callable[[Array], Array]
"""Cost c(x) of each of T states: from (T, D) to (T,), each in [0, 1]."""

_TILT, _WHEEL_ANGLE = Observation._fields.index("tilt"), Observation._fields.index("wheel_angle")
_NEARLY = 1e-9  # of a control period: a time that is a whole number of them is not rounded up


@dataclass(frozen=True)
class SuccessCriterion:
    """When a trial counts as a success: upright, settled, in place and quiet; the last two only where asked.

    Where something controlled the heading, that counts, too.

    Attributes:
        tilt_limit: the tilt must never pass this [rad].
        settled_tilt_limit: from `settle_step` on the tilt must stay under this [rad].
        settle_step: control periods the policy has for recovering from its start.
        steps: control periods that a trial lasts.
        place_step: control periods that it has for coming back to where it was put.
        place_radii: how far from there it may be from then on [wheel radii]; None: not asked.
        command_change: under which the change of the sent command from step to step must be from `settle_step` on,
            root mean square, as a share of the torque limit; None: not asked.
        heading_limit: how far the heading may be off that of its reference from `place_step` on [rad]; None: not asked.
        wheel_radius: of the data sheet [m]; None: place is known from true poses alone.
        torque_limit: [N·m]; None: commands are not judged.

    Raises:
        ConfigError: no trial could meet it, every trial would, or what it asks cannot be told.
    """

    tilt_limit: float
    settled_tilt_limit: float
    settle_step: int
    steps: int
    place_step: int = 0
    place_radii: float | None = None
    command_change: float | None = None
    wheel_radius: float | None = None
    torque_limit: float | None = None
    heading_limit: float | None = None

    def __post_init__(self) -> None:
        if not 0 < self.settled_tilt_limit <= self.tilt_limit:
            raise ConfigError(
                "settled_tilt_limit must be positive and at most tilt_limit; "
                f"found {self.settled_tilt_limit} and {self.tilt_limit} rad."
            )
        if not 0 <= self.settle_step <= self.steps or self.steps < 1:
            raise ConfigError(
                f"settle_time must lie within the trial; found step {self.settle_step} of a trial of {self.steps}."
            )
        if self.heading_limit is not None and not 0 < self.heading_limit < inf:
            raise ConfigError(
                f"success.heading_limit must be more than 0, or null where it is not asked; found {self.heading_limit}."
            )
        needs = {"place_radii": "wheel_radius", "command_change": "torque_limit"}
        for name, needed in needs.items():
            asked = getattr(self, name)
            if asked is not None and not 0 < asked < inf:
                raise ConfigError(f"success.{name} must be more than 0, or null where it is not asked; found {asked}.")
            if asked is not None and getattr(self, needed) is None:
                raise ConfigError(f"success.{name} needs the {needed} of the robot.")
        if self.place_radii is not None and not 0 <= self.place_step <= self.steps:
            raise ConfigError(
                f"place_time must lie within the trial; found step {self.place_step} of a trial of {self.steps}. "
                "Give a shorter success.place_time, or success.place_radii=null."
            )
        if self.command_change is not None and self.settle_step > self.steps - 2:
            raise ConfigError(
                f"No command changes after step {self.settle_step} of a trial of {self.steps}. Give a shorter "
                "success.settle_time, or success.command_change=null."
            )

    @classmethod
    def in_seconds(
        cls,
        *,
        tilt_limit: float,
        settled_tilt_limit: float,
        duration: float,
        settle_time: float,
        place_time: float,
        place_radii: float | None,
        command_change: float | None,
        control_period: float,
        wheel_radius: float,
        torque_limit: float,
        heading_limit: float | None = None,
    ) -> Self:
        """The criterion with its times in seconds, as a user gives them, for a robot.

        A time that is no whole number of control periods ends with the period that it lies in.

        Args:
            tilt_limit, settled_tilt_limit, place_radii, command_change, heading_limit: see the class.
            duration: of a trial [s].
            settle_time: before the tilt must have settled, and the commands be quiet [s].
            place_time: before it must be back in place [s].
            control_period: of the robot [s].
            wheel_radius: of the robot [m].
            torque_limit: of the robot [N·m].
        """

        def periods(time: float) -> int:
            return ceil(time / control_period - _NEARLY)

        return cls(
            tilt_limit=tilt_limit,
            settled_tilt_limit=settled_tilt_limit,
            settle_step=periods(settle_time),
            steps=periods(duration),
            place_step=periods(place_time),
            place_radii=place_radii,
            command_change=command_change,
            wheel_radius=wheel_radius,
            torque_limit=torque_limit,
            heading_limit=heading_limit,
        )

    @property
    def place_limit(self) -> float | None:
        """How far the robot may be from where it was put [m]; None where that is not asked."""
        return None if self.place_radii is None or self.wheel_radius is None else self.place_radii * self.wheel_radius


class PlaceBy(StrEnum):
    """What tells where a robot is."""

    POSE = "pose"
    """True poses: a simulation's, or those of cameras."""
    ODOMETRY = "odometry"
    """The robot's own wheels and its tilt, by the wheel radius of the data sheet."""


class TrialVerdict(NamedTuple):
    """What a trial shows, part by part. One that ended early has none of the parts that are asked.

    Attributes:
        upright: inside the tilt limit throughout, to the end.
        settled: under the settled tilt limit from the settle step on.
        in_place: within reach of where it was put from the place step on; None where that is not asked.
        quiet: the commands' changes were small from the settle step on; None where that is not asked.
        place_by: what told where it was; None where nothing did.
        farthest: greatest distance from where it was put, from the place step on [m]; None where it is not known.
        command_change: root mean square of the sent command's change from step to step, from the settle step on, as a
            share of the torque limit; None where it is not known.
        oscillation: of the tilt, from the place step on, peak to peak [rad]; None where the trial ended before.
        seconds: how long it lasted [s].
        on_heading: within the heading's limit from the place step on; None where that is not asked, or nothing
            controlled the heading.
        heading_off: most by which the heading was off that of its reference, from the place step on [rad]; where
            nothing controlled it, off that with which it was put. None where it is not known.
        used: greatest share of a limit that it used, of those of settled tilt, place, command and heading; infinite
            where it ended early.
    """

    upright: bool
    settled: bool
    in_place: bool | None
    quiet: bool | None
    place_by: PlaceBy | None
    farthest: float | None
    command_change: float | None
    oscillation: float | None
    seconds: float
    on_heading: bool | None = None
    heading_off: float | None = None
    used: float = inf

    @property
    def succeeded(self) -> bool:
        """Whether all that is asked is there."""
        parts = self.upright, self.settled, self.in_place, self.quiet, self.on_heading
        return all(part is not False for part in parts)


def judged(episode: Episode, rule: SuccessCriterion) -> TrialVerdict:
    """What a trial shows of what `rule` asks; what comes after `rule.steps` does not count.

    The distance is that of the true poses where each sample from the place step on has one, else that of odometry.
    """
    tilt, lasted = np.abs(episode.tilt[: rule.steps + 1]), len(episode) >= rule.steps
    late = slice(rule.place_step, rule.steps + 1)
    away, place_source = _distances(episode, late, rule.wheel_radius)
    change = _command_change(episode, rule)
    farthest = float(away.max()) if len(away) else None
    errors = None if episode.heading_errors is None else episode.heading_errors[late]
    off = None if errors is None or not len(errors) else float(np.abs(errors).max())
    limit = None if episode.headings is None else rule.heading_limit
    return TrialVerdict(
        upright=bool(lasted and tilt.max() <= rule.tilt_limit),
        settled=bool(lasted and tilt[rule.settle_step :].max() < rule.settled_tilt_limit),
        in_place=None if rule.place_limit is None else lasted and farthest is not None and farthest <= rule.place_limit,
        quiet=None if rule.command_change is None else lasted and change is not None and change < rule.command_change,
        place_by=place_source,
        farthest=farthest,
        command_change=change,
        oscillation=float(np.ptp(episode.tilt[late])) if len(episode.tilt[late]) else None,
        seconds=min(len(episode), rule.steps) * episode.control_period,
        on_heading=None if limit is None else lasted and off is not None and off <= limit,
        heading_off=off,
        used=_used((float(tilt[rule.settle_step :].max()), farthest, change, off), rule, limit) if lasted else inf,
    )


def _used(values: Sequence[float | None], rule: SuccessCriterion, heading_limit: float | None) -> float:
    """Greatest share of a limit; see `TrialVerdict`.

    Args:
        values: tilt, distance, change of the command and heading.
        rule: with the limits of the first three.
        heading_limit: None where the heading is not judged.
    """
    limits = rule.settled_tilt_limit, rule.place_limit, rule.command_change, heading_limit
    pairs = zip(values, limits, strict=True)
    return max(value / limit for value, limit in pairs if value is not None and limit is not None)


def _distances(episode: Episode, part: slice, wheel_radius: float | None) -> tuple[Array, PlaceBy | None]:
    """Distance from where the robot was put at the samples of `part` [m], and what told it."""
    if episode.poses is not None and np.isfinite(episode.poses[part]).all():
        return np.hypot(episode.poses[part, 0], episode.poses[part, 1]), PlaceBy.POSE
    if wheel_radius is None:
        return np.empty(0), None
    return np.abs(positions(episode, wheel_radius)[part]), PlaceBy.ODOMETRY


def _command_change(episode: Episode, rule: SuccessCriterion) -> float | None:
    """Root mean square of the sent command's changes, as a share of the torque limit; None without two commands."""
    commands = episode.commands[rule.settle_step : rule.steps]
    if rule.torque_limit is None or len(commands) < 2:
        return None
    sent = np.clip(commands, -rule.torque_limit, rule.torque_limit)
    return float(np.sqrt(np.mean(np.diff(sent) ** 2))) / rule.torque_limit


def real_cost(episode: Episode, cost: StateCost, horizon: int) -> float:
    """Long-term cost Σ_{t=1..H} c(x_t) of what the robot did, H = `horizon` (eq. 9, without expectation).

    A step that the robot did not reach counts as 1, whatever ended the rollout early: it is not balancing then. x_0 is
    left out, as no policy can change it; the cost lies in [0, H]. A rollout that was completed, and is shorter than the
    horizon, has no such cost: the robot may well have balanced on, and a sum over fewer steps compares with no other.

    Args:
        episode: T steps, with the state that the cost is of.
        cost: of the states, from (T, D) to (T,).
        horizon: H [control periods].

    Raises:
        DataError: the rollout was completed before the horizon.
    """
    if episode.outcome is Outcome.COMPLETED and len(episode) < horizon:
        raise DataError(
            f"A completed rollout of {len(episode)} control periods has no long-term cost over {horizon}: nobody knows "
            "what comes after its end. Drive longer rollouts, or take a smaller horizon (search.horizon)."
        )
    states = episode.states[1 : horizon + 1]
    seen = float(np.sum(cost(states))) if len(states) else 0.0
    return seen + horizon - len(states)


def check_horizon(rule: SuccessCriterion, horizon: int) -> None:
    """Check that a trial lasts long enough for its long-term cost.

    Args:
        rule: says how long a trial lasts.
        horizon: over which costs are summed [control periods].

    Raises:
        ConfigError: it ends before the horizon.
    """
    if rule.steps < horizon:
        raise ConfigError(
            f"A trial must last as long as the horizon of its cost; found success.duration of {rule.steps} control "
            f"periods and search.horizon={horizon}. Give a longer success.duration, or search.horizon={rule.steps} or "
            "less."
        )


def positions(episode: Episode, wheel_radius: float) -> Array:
    """How far the axle has rolled since the start, (T + 1,) [m].

    The encoders see the wheel relative to the body, so over ground it has turned by wheel angle + tilt. `wheel_radius`
    is that of the data sheet [m].
    """
    turned = episode.observations[:, _WHEEL_ANGLE] + episode.observations[:, _TILT]
    travelled: Array = wheel_radius * (turned - turned[0])
    return travelled


def drift(episode: Episode, wheel_radius: float) -> float:
    """Distance between where the robot started and where it ended [m]."""
    return float(abs(positions(episode, wheel_radius)[-1]))
