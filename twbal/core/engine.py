"""What integrates a robot's motion, and the plant made of it."""

from abc import ABC, abstractmethod
from math import ceil
from typing import NamedTuple

from twbal.core.errors import ConfigError, LinkError
from twbal.core.plant import Observation, Plant, Pose
from twbal.core.robot_model import EffectState, RobotModel
from twbal.core.start_pose import InitialState, StartPose
from twbal.core.streams import Stream, generator

NEARLY = 1e-6
"""Share of a physics step by which the one that is used may be longer: of periods written to few digits."""
_SAME = 1e-9  # share of a step by which the same one may differ


class RobotMotion(NamedTuple):
    """True motion of a robot at one instant.

    Attributes:
        tilt: [rad].
        tilt_rate: about the axle [rad/s].
        speed: of the middle of the axle, forward [m/s].
        wheel_angle: mean of both wheels, relative to the body; of the motors' shafts, where the encoders sit on these
            [rad].
        wheel_rate: [rad/s].
        yaw_rate: about the vertical [rad/s].
    """

    tilt: float
    tilt_rate: float
    speed: float
    wheel_angle: float
    wheel_rate: float
    yaw_rate: float


class Engine(ABC):
    """Integrates one robot's motion at a fixed physics step."""

    @abstractmethod
    def reset(self, initial: InitialState) -> None:
        """Put the robot at its start, as though nothing had run before."""

    @abstractmethod
    def advance(self, command: float, effect_state: EffectState, steps: int) -> None:
        """Take physics steps; in each, the joints get what `effect_state` makes of the held command [N·m]."""

    @abstractmethod
    def motion(self) -> RobotMotion:
        """The motion now."""

    @abstractmethod
    def pose(self) -> Pose:
        """Where the robot is now, in the frame in which `reset` put it down."""

    @abstractmethod
    def close(self) -> None:
        """Free what is held. Safe to call twice."""


class EnginePlant(Plant):
    """A simulated robot behind the interface `Plant`.

    A trial's start pose and noise follow from (seed, trial) alone: the same trial gives the same bits, whatever ran
    before it. A command is cut to the torque limit and held for one control period.

    Args:
        model: the robot with its effects.
        engine: integrates it, at `physics_step`.
        start: where rollouts begin.
        physics_step: [s]; divides the control period, as that of `dividing_step` does.
        seed: of all randomness.

    Raises:
        ConfigError: the physics step is not positive.
    """

    def __init__(self, model: RobotModel, engine: Engine, start: StartPose, physics_step: float, seed: int) -> None:
        self.control_period, self.command_limit = model.robot.control_period, model.torque_limit
        self._model = model
        self._engine = engine
        self._start = start
        self._physics_step = physics_step
        self._substeps = substeps(self.control_period, physics_step)
        self._seed = seed
        self._effect_state = EffectState((), ())
        self._periods = 0
        self._speed = 0.0
        self._closed = False

    def reset(self, trial: int) -> Observation:
        """Begin the rollout that (seed, trial) names.

        Raises:
            LinkError: this plant was closed.
        """
        if self._closed:
            raise LinkError(
                "This simulated plant was closed, as at the end of its `with` block. Make another one, and drive it "
                "within the block."
            )
        initial = self._start.draw(generator(Stream.START_POSE, self._seed, trial))
        self._effect_state = self._model.start(self._physics_step, generator(Stream.SENSOR_NOISE, self._seed, trial))
        self._engine.reset(initial)
        self._periods = 0
        self._speed = self._engine.motion().speed
        return self._observe()

    def step(self, command: float) -> Observation:
        """Hold the command, cut to the torque limit, for one control period.

        Raises:
            DataError: the command is not finite.
        """
        self._engine.advance(self._model.clip(command), self._effect_state, self._substeps)
        self._periods += 1
        return self._observe()

    def pose(self) -> Pose:
        """The true pose at the last observation, whatever the sensors say."""
        return self._engine.pose()

    def stop(self) -> None:
        """Nothing turns between the steps of a simulation."""

    def close(self) -> None:
        """Free the engine."""
        self._engine.close()
        self._closed = True

    def _observe(self) -> Observation:
        motion = self._engine.motion()
        acceleration = (motion.speed - self._speed) / self.control_period
        self._speed = motion.speed
        truth = Observation(
            time=self._periods * self.control_period,
            tilt=motion.tilt,
            tilt_rate=motion.tilt_rate,
            acceleration=acceleration,
            wheel_angle=motion.wheel_angle,
            wheel_rate=motion.wheel_rate,
            yaw_rate=motion.yaw_rate,
        )
        return self._effect_state.sense(truth)


def substeps(control_period: float, physics_step: float) -> int:
    """Physics steps in a control period, each of them at most `physics_step` long, up to a share `NEARLY` of it.

    Args:
        control_period: [s].
        physics_step: upper bound [s].

    Raises:
        ConfigError: the physics step is not positive.
    """
    if not 0 < physics_step < float("inf"):
        raise ConfigError(f"The physics step must be positive and finite; found {physics_step} s.")
    return max(ceil(control_period / physics_step - NEARLY), 1)


def dividing_step(control_period: float, physics_step: float) -> float:
    """The step that is used: the longest one that divides a control period and is at most a physics step [s].

    Where the period is a whole number of physics steps, it is `physics_step` itself, to the bit.

    Args:
        control_period: [s].
        physics_step: upper bound [s].

    Raises:
        ConfigError: the physics step is not positive.
    """
    step = control_period / substeps(control_period, physics_step)
    return physics_step if abs(step - physics_step) <= _SAME * physics_step else step
