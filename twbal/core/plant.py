"""The interface of a robot: what twbal needs of it, simulated or real.

Signs: tilt > 0 leans forward (+x), wheel angle > 0 rolls forward, a positive command drives the wheels forward and the
body back. The command u is the sum of the two wheel torques [N·m].
"""

from abc import ABC, abstractmethod
from math import inf
from typing import NamedTuple, Self

from twbal.core.errors import ConfigError


class Observation(NamedTuple):
    """What the robot's sensors say at one control instant.

    Attributes:
        time: robot's own clock since the rollout began [s].
        tilt: body's angle from the vertical [rad].
        tilt_rate: body's angular velocity, from the gyro [rad/s].
        acceleration: platform's forward acceleration, mean over the last control period [m/s²].
        wheel_angle: mean of the two encoders, wheel relative to body [rad].
        wheel_rate: rate of `wheel_angle` [rad/s].
        yaw_rate: turning rate about the vertical, from the gyro [rad/s].
    """

    time: float
    tilt: float
    tilt_rate: float
    acceleration: float
    wheel_angle: float
    wheel_rate: float
    yaw_rate: float


class Pose(NamedTuple):
    """Where a robot truly is, in the frame in which it was put down at (0, 0) with heading 0.

    A simulation knows it, or cameras that watch the robot. Policies and models never see it.

    Attributes:
        x: forward, of the middle of the axle [m].
        y: to the left [m].
        heading: about the vertical, positive to the left [rad].
        tilt: of the body [rad].
    """

    x: float
    y: float
    heading: float
    tilt: float


class WheelDifference(NamedTuple):
    """How far the right wheel is ahead of the left one.

    Attributes:
        angle: right minus left, relative to the body [rad].
        rate: of that [rad/s]; NaN where nothing measures it.
    """

    angle: float
    rate: float


class Plant(ABC):
    """A robot that can be put at its start, driven one control period at a time, and let go.

    A plant is a context manager; leaving it, on whatever way, stops the motors.
    """

    control_period: float  # [s]
    command_limit: float = inf  # to which commands are cut [N·m]
    difference_limit: float = inf  # to which differences of the wheel torques are cut [N·m]
    turns: bool = False  # whether its wheels can be driven apart
    has_yaw_gyro: bool = True  # whether `Observation.yaw_rate` is measured

    @abstractmethod
    def reset(self, trial: int) -> Observation:
        """Put the robot at its start and return the first observation.

        Args:
            trial: number that names this rollout. A simulated robot draws its start pose and its noise from it (and
                from its own seed), so that the same trial is the same rollout; a person places a real robot.

        Raises:
            LinkError: the robot cannot be reached.
        """

    @abstractmethod
    def step(self, command: float) -> Observation:
        """Apply `command` [N·m] for one control period and return what is seen at its end.

        Raises:
            LinkLostError: the robot fell silent.
        """

    def drive_until(self, time: float, command: float) -> None:  # noqa: B027, most robots need it not
        """Apply `command` up to a time within the control period that has begun; `step` drives the rest of it.

        A simulated robot in real time moves so while the time passes, and not all at once when a period is over. One
        that cannot leaves the whole period to `step`.

        Args:
            time: since the last observation, no earlier than that of the call before; not beyond the period's end [s].
            command: as of `step` [N·m].
        """

    def pose(self) -> Pose | None:
        """The true pose at the last observation; None where nothing but the robot's own sensors tells."""
        return None

    def applied(self) -> float | None:
        """What the motors were given in the last control period, where the robot decides that; None: the command."""
        return None

    def follow(  # noqa: B027, most robots need it not
        self, position: float, speed: float, gives_way: bool = False
    ) -> None:
        """Tell a policy that drives on board of the robot the reference, from the next step on.

        Args:
            position: along the robot's way, from where it was put [m].
            speed: [m/s].
            gives_way: whether it waits for a robot that cannot follow (`Reference`).
        """

    def steer(self, difference: float) -> None:
        """Set the difference of the wheel torques, right minus left, from the next step on; a reset sets it to 0.

        Args:
            difference: positive turns to the left [N·m].

        Raises:
            ConfigError: this robot does not turn.
        """
        raise ConfigError(f"The robot cannot be turned: its wheels get one torque; found a difference of {difference}.")

    def wheel_difference(self) -> WheelDifference | None:
        """How far the wheels are apart at the last observation; None where nothing measures it."""
        return None

    @abstractmethod
    def stop(self) -> None:
        """Stop the motors at the end of a rollout. Safe to call twice.

        Raises:
            LinkLostError: the robot does not confirm that they are off.
        """

    @abstractmethod
    def close(self) -> None:
        """Stop the motors and free what is held. Safe to call twice."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()
