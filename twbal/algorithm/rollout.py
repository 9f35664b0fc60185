"""One loop that drives a robot, simulated or real, and records what it did."""

import math
from collections.abc import Callable
from numbers import Real

import numpy as np

from twbal.core.channels import Channels, StateTracker
from twbal.core.course import Standing
from twbal.core.episode import Ending, Episode, Event, Outcome, Provenance
from twbal.core.errors import ConfigError, DataError, LinkLostError, TwbalError
from twbal.core.feed_forward import FeedForward, added
from twbal.core.gaussian import Array
from twbal.core.heading import HeadingSample
from twbal.core.heading_control import HeadingControl
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation, Plant, Pose, WheelDifference
from twbal.core.reference import FASTEST_TAKEN, Reference, Targets
from twbal.core.streams import Stream, generator
from twbal.policies.policy import BoundedPolicy, Controller, Policy

MAX_TILT_LIMIT = math.pi / 2
"""Largest tilt limit [rad]: beyond it a robot lies on the ground."""

Watch = Callable[[Observation, Motion, HeadingSample | None, float], Ending | None]
"""Looks at an observation, the reference, what the heading's control knows and the command that acted until then
(0 before the first) [N·m]; tells an end of the rollout."""
_EXPECTED_CONTROLLER = (
    "Expected is a method `controller(self, rng)` that returns a law: a function from the state to the command [N·m]."
)
_NO_POSE = Pose(*(math.nan,) * len(Pose._fields))


def rollout(
    plant: Plant,
    policy: Policy,
    channels: Channels,
    steps: int,
    tilt_limit: float,
    provenance: Provenance,
    targets: Targets | None = None,
    heading: HeadingControl | None = None,
    watch: Watch | None = None,
    feed_forward: FeedForward | None = None,
    yields: bool = False,
) -> Episode:
    """Drive `plant` by `policy` for at most `steps` control periods.

    The rollout ends early where the tilt passes its limit, the robot falls silent or measures what is no number, its
    clock does not run forward, the policy raises or commands what is no number, or the person presses Ctrl-C; the
    episode so far is returned with that outcome, and the motors are stopped on every way out. A robot that does not
    confirm its last stop ends as a lost link, too.

    Args:
        tilt_limit: measured |tilt| at which the rollout ends, at most `MAX_TILT_LIMIT` [rad].
        provenance: its seed and trial seed the policy's randomness too.
        targets: where the reference goes that the robot is to follow; None: it is to stay where it was put, and no
            reference gives way to what pushes or holds it.
        heading: controls the heading, for this rollout; None: nothing does.
        watch: called after each observation, before the command; None: nobody ends the rollout.
        feed_forward: of the reference's acceleration; None: nothing is fed forward.
        yields: whether a reference on its way takes on speed from a robot that is pushed (`PushDetector`), as that of a
            robot that is to stand (`Standing`) always does.

    Raises:
        ConfigError: the tilt limit would never end a fall.
        DataError: the policy gives no law, or the plant returns what is no observation.
        LinkError: the robot could not be reached at all, or its first observation cannot be used.
    """
    _check_tilt_limit(tilt_limit)
    rng = generator(Stream.EXPLORATION, provenance.seed, provenance.trial)
    # Where a policy does not tell its largest command, the plant cuts what is too large.
    most_command = policy.max_command if isinstance(policy, BoundedPolicy) else math.inf
    record = _Record(channels, targets, heading, feed_forward, yields)
    try:
        try:
            controller = _controller(policy, rng, provenance.trial)
            record.note(plant.reset(provenance.trial), plant.pose(), plant.wheel_difference())
            _drive(plant, controller, record, steps, tilt_limit, watch, most_command)
        except (LinkLostError, KeyboardInterrupt) as ended:
            record.end_by(ended)
        finally:
            plant.stop()
        if record.states:
            return record.episode(plant.control_period, provenance)  # in here, so that Ctrl-C does not cost it
    except LinkLostError as unstopped:
        record.end_by(unstopped)
    except KeyboardInterrupt as pressed:  # in the stop, or later
        record.end_by(pressed)
        try:
            plant.stop()
        except LinkLostError as unstopped:
            record.end_by(unstopped)
    return record.episode(plant.control_period, provenance)


def _check_tilt_limit(tilt_limit: float) -> None:
    """Check the tilt at which a rollout ends.

    Raises:
        ConfigError: it would never end a fall, or end every rollout.
    """
    if not 0 < tilt_limit <= MAX_TILT_LIMIT:
        raise ConfigError(
            f"The tilt limit of a rollout must be more than 0 and at most {MAX_TILT_LIMIT:.4f} rad (90°, where a robot "
            f"lies on the ground); found {tilt_limit}. Is it in rad?"
        )


def _controller(policy: Policy, rng: np.random.Generator, trial: int) -> Controller:
    """The law of `policy` for rollout `trial`.

    Raises:
        DataError: `controller` raises, or returns what cannot be called.
    """
    try:
        law = policy.controller(rng)
    except TwbalError:
        raise
    except Exception as error:  # of anybody's policy
        raise DataError(
            f"Rollout {trial} did not begin: `controller` of the policy {type(policy).__name__} ended with the error "
            f"{type(error).__name__}: {error}. {_EXPECTED_CONTROLLER}"
        ) from error
    if not callable(law):
        raise DataError(
            f"Rollout {trial} did not begin: `controller` of the policy {type(policy).__name__} returned {law!r:.80}. "
            f"{_EXPECTED_CONTROLLER}"
        )
    return law


def _drive(
    plant: Plant,
    controller: Controller,
    record: "_Record",
    steps: int,
    tilt_limit: float,
    watch: Watch | None,
    most: float,
) -> None:
    """From the first observation to the last, to the tilt limit, or to where `watch` ends it.

    Args:
        most: command to which the policy's, with what is fed forward, is cut [N·m].
    """
    while len(record.commands) < steps:
        if abs(record.seen[-1].tilt) > tilt_limit:
            record.outcome = Outcome.TILT_LIMIT
            return
        if ending := record.shown_to(watch):
            record.end(*ending)
            return
        try:
            command = controller(record.for_policy.copy())  # a law may work on it in place; the record stays
        except Exception as error:  # of anybody's policy; what was driven so far is kept
            found, state = f"{type(error).__name__}: {error}", record.for_policy.tolist()
            record.end(Outcome.POLICY_FAULT, f"The policy ended with the error {found}, in state {state}.")
            return
        number = _number(command)
        if number is None:
            state = record.for_policy.tolist()
            record.end(
                Outcome.POLICY_FAULT,
                f"The policy commands {command} N·m, which is no number, in state {state}.{_about_array(command)}",
            )
            return
        command = added(number, record.feed_forward_torque, most)
        record.tell(plant)
        if record.heading is not None:
            plant.steer(record.heading.difference(command, plant.difference_limit))
        observation = plant.step(command)
        applied = plant.applied()
        sent = min(max(command, -plant.command_limit), plant.command_limit)
        record.commands.append(sent if applied is None else applied)
        record.note(observation, plant.pose(), plant.wheel_difference())


def _number(command: object) -> float | None:
    """What a policy commands as a number, also of an array that holds just one; None where it is no finite number."""
    single = command.item() if isinstance(command, np.ndarray) and command.size == 1 else command
    try:
        return float(single) if math.isfinite(single) else None  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return None


def _about_array(command: object) -> str:
    """What to return in place of an array of several numbers, or of none."""
    shape = np.shape(command) if isinstance(command, np.ndarray | list | tuple) else ()
    return f" It is an array of shape {shape}: return one number, as by float(u)." if shape not in ((), (1,)) else ""


def _observation(returned: object) -> Observation:
    """What `reset` or `step` of a plant returned, as an observation; seven numbers in its order will do.

    Raises:
        DataError: it is none.
    """
    names = Observation._fields
    is_list = isinstance(returned, tuple | list) or (isinstance(returned, np.ndarray) and returned.ndim == 1)
    numbers = list(returned) if is_list else []  # type: ignore[call-overload]
    if len(numbers) == len(names) and all(isinstance(each, Real) for each in numbers):
        return returned if isinstance(returned, Observation) else Observation(*map(float, numbers))
    raise DataError(
        f"`reset` and `step` of a plant must return an Observation, or its {len(names)} numbers in this order: "
        f"{', '.join(names)}; found {returned!r:.120}."
    )


class _Record:
    """What a rollout has shown so far, and how it ended; Ctrl-C may come between any two lines.

    Attributes:
        seen, poses, states, references, commands: as in `Episode`, as lists; of a step that was cut short some may be
            there.
        outcome: how it ended.
        heading: what controls it, with samples of its own.
    """

    def __init__(
        self,
        channels: Channels,
        targets: Targets | None,
        heading: HeadingControl | None,
        feed_forward: FeedForward | None,
        yields: bool,
    ) -> None:
        self.seen: list[Observation] = []
        self.poses: list[Pose] = []
        self.references: list[Motion] = []
        self.states: list[Array] = []
        self.commands: list[float] = []
        self.outcome = Outcome.COMPLETED
        self.heading = heading
        self._channels = channels
        self._is_to_stand = isinstance(targets, Standing)
        most_taken = 1.0 if self._is_to_stand else FASTEST_TAKEN * yields
        self._reference = None if targets is None else Reference(targets, most_taken=most_taken)
        self._tracker = StateTracker(channels, self._reference, feed_forward)
        self._events: list[Event] = []
        self._ended_by: BaseException | None = None

    def note(self, seen: Observation, pose: Pose | None, apart: WheelDifference | None) -> None:
        """Take down what is seen after the last command, and the true pose where something tells it.

        Args:
            seen: by the sensors.
            pose: true one; None where nothing tells it.
            apart: how far the wheels are apart; None where they are not told apart.

        Raises:
            DataError: it is no observation.
            LinkLostError: it is not finite, or not later than what was seen before.
        """
        seen = _observation(seen)
        if not all(map(math.isfinite, seen)):
            raise LinkLostError(f"The robot sent a value that is not a finite number: {seen}.")
        if self.seen and seen.time <= self.seen[-1].time:
            raise LinkLostError(
                f"The robot's clock does not run forward: it said {self.seen[-1].time} s, and then {seen.time} s."
            )
        if pose is not None and not all(map(math.isfinite, pose)):
            raise LinkLostError(f"The robot's true pose was said to be {pose}; expected finite numbers.")
        self.seen.append(seen)
        self.poses.append(_NO_POSE if pose is None else pose)
        state = self._tracker.state(seen, self.commands)
        if self._reference is not None:
            self.references.append(self._reference.motion)
        if self.heading is not None:
            self.heading.follow(seen, apart, self._reference.motion if self._reference else Motion())
        self.states.append(state)

    @property
    def for_policy(self) -> Array:
        """The last state as the policy sees it."""
        return self._tracker.for_policy

    @property
    def feed_forward_torque(self) -> float:
        """What the reference's acceleration needs [N·m]."""
        return self._tracker.offset.torque

    def tell(self, plant: Plant) -> None:
        """Tell the robot the reference at the last observation, where there is one."""
        if (reference := self._reference) is not None:
            plant.follow(reference.motion.position, reference.motion.speed, reference.gives_way)

    def shown_to(self, watch: Watch | None) -> Ending | None:
        """What `watch` says to the last observation."""
        reference = self._reference.motion if self._reference else Motion()
        heading = self.heading.samples[-1] if self.heading else None
        command = self.commands[-1] if self.commands else 0.0
        return None if watch is None else watch(self.seen[-1], reference, heading, command)

    def end(self, outcome: Outcome, text: str) -> None:
        """Note how the rollout ends."""
        self.outcome = outcome
        self._events.append(Event(self.seen[len(self.states) - 1].time if self.states else 0.0, text))

    def end_by(self, error: LinkLostError | KeyboardInterrupt) -> None:
        """Note what ends the rollout; a link that is lost stays lost."""
        self._ended_by = error
        lost = isinstance(error, LinkLostError) or self.outcome is Outcome.LINK_LOST
        self.end(Outcome.LINK_LOST if lost else Outcome.STOPPED, str(error) or "stopped by the person")

    def episode(self, control_period: float, provenance: Provenance) -> Episode:
        """The episode so far; raises what ended the rollout where nothing was seen at all."""
        if self._ended_by is not None and not self.states:
            raise self._ended_by
        complete = len(self.states)
        poses = np.array(self.poses[:complete])
        return Episode(
            channels=self._channels.names,
            control_period=control_period,
            observations=np.array(self.seen[:complete]),
            states=np.array(self.states),
            commands=np.array(self.commands[: complete - 1]),
            outcome=self.outcome,
            provenance=provenance,
            events=self._all_events(),
            poses=None if np.isnan(poses).all() else poses,
            references=np.array(self.references[:complete]) if self._has_references else None,
            headings=np.array(self.heading.samples[:complete]) if self.heading else None,
        )

    @property
    def _has_references(self) -> bool:
        """Whether there was a reference to follow; one that is to stand counts where it had to move."""
        if self._reference is None:
            return False
        return not self._is_to_stand or any(motion != Motion() for motion in self.references)

    def _all_events(self) -> tuple[Event, ...]:
        followed = [self._reference, self.heading.reference if self.heading else None]
        of_references = sorted(
            (event for reference in followed if reference for event in reference.events), key=lambda event: event.time
        )
        return (*of_references, *self._events)
