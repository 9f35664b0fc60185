"""The planar (analytical) model behind the seam."""

from collections.abc import Sequence
from dataclasses import astuple
from math import exp
from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel, rarely
from twbal.core.engine import dividing_step, substeps
from twbal.core.errors import ConfigError
from twbal.core.gaussian import Array
from twbal.core.plant import Observation, Plant, Pose
from twbal.core.robot_model import UNBOUNDED, Reading, clipped
from twbal.core.robot_parameters import RobotParameters
from twbal.core.sine_cosine import sine_and_cosine
from twbal.core.start_pose import StartPose
from twbal.core.streams import Stream, generator
from twbal.core.swinging_part import swinging_part, without_part
from twbal.effects.effect import Effect, assemble
from twbal.effects.library import values_of
from twbal.effects.sensor_noise import SensorNoise
from twbal.planar.actuation import EVEN, command_at, command_between, slew_limited
from twbal.planar.constants import Constants, constants
from twbal.planar.forces import tipped
from twbal.planar.motion import step
from twbal.planar.parameters import PlanarParameters, planar_parameters
from twbal.planar.planar_state import STRAIGHT, PlanarState, Turning
from twbal.planar.sensing import fuse, imu_settled, read_sensors, ring_length, see
from twbal.planar.terms import drive

_NOTHING = (0.0,) * (len(PlanarState._fields) - 7)


@kernel(is_inlined=True)
def hold(
    p: PlanarParameters,
    k: Constants,
    s: PlanarState,
    commands: Array,
    past: int,
    substeps: int,
    turning: Turning,
    imu: Array,
    instants: Array,
) -> PlanarState:
    """One control period of the planar model; it writes what the IMU sees into the ring `imu`.

    Args:
        p: the planar model.
        k: its constants.
        s: state at the period's start.
        commands: (T,) of the rollout [N·m]; that of this period is the one at index `past`.
        past: control periods before this one.
        substeps: physics steps of a period.
        turning: at the period's start; its rate stays.
        imu: (N, 4), as of `read_sensors`.
        instants: (T + 1,) of an uneven loop, at which its periods begin and its commands come [s]; `EVEN` of an even
            one, whose periods have the length of this one.
    """
    reached, ramped, first = s.torque, s.driver_torque, s
    late = k.delay / (k.step * substeps)
    length = 1.0 / substeps
    cosine, sine, by = turning.cosine, turning.sine, sine_and_cosine(k.step * turning.rate)
    row, kept = past * substeps % len(imu), exp(-k.filter.rate * k.step) if k.filter.rate > 0.0 else 1.0
    for i in range(substeps):
        number = past * substeps + i
        if rarely(len(instants) > 0):
            time = instants[past] + i * k.step
            command = command_between(commands, instants, past, time - k.delay, k.step)
        else:
            time = number * k.step
            command = commands[past] if late == 0.0 else command_at(commands, number * length - late, length)
        demanded = drive(p, command, time)
        if rarely(k.slew < UNBOUNDED):
            ramped, demanded = slew_limited(ramped, demanded, k.slew)
        now = Turning(turning.rate, turning.heading + i * k.step * turning.rate, cosine, sine)
        cosine, sine = cosine * by.cosine - sine * by.sine, sine * by.cosine + cosine * by.sine
        before = s
        s = step(p, k, s, demanded + k.fade * (reached - demanded), time, now)
        if rarely(k.slope != 0.0 and turning.rate != 0.0):
            s = tipped(k, s, now, Turning(turning.rate, now.heading + k.step * turning.rate, cosine, sine))
        reached += k.lag * (demanded - reached)
        row = row + 1 if row + 1 < len(imu) else 0  # cheaper than a remainder
        see(p, k, before, s, imu, row, kept, time + k.step)
    if rarely(k.filter.rate > 0.0 or k.filter.lead != 0.0):
        fuse(k, first, s, k.step * substeps, imu, row)
    return PlanarState(
        s.tilt, s.wheel, s.tilt_rate, s.wheel_speed, reached, s.rotor, s.rotor_speed, s.slip, s.position, ramped,
        s.sway, s.sway_rate, s.x, s.y, s.left_joint, s.right_joint, s.left_ground, s.right_ground,
    )  # fmt: skip


@kernel()
def standing(k: Constants, tilt: float, tilt_rate: float, speed: float, wheel_angle: float) -> PlanarState:
    """The state at a rollout's start: motors without torque, rotors in the middle of the backlash.

    Args:
        k: constants of the planar model.
        tilt: [rad].
        tilt_rate: [rad/s].
        speed: of the axle [m/s].
        wheel_angle: of the encoders [rad].
    """
    wheel = wheel_angle + tilt
    turning = speed / k.radius
    return PlanarState(tilt, wheel, tilt_rate, turning, 0.0, wheel, turning, *_NOTHING)


class Seen(NamedTuple):
    """The end of a control period.

    Attributes:
        state: of the robot.
        reading: of its sensors, without noise.
    """

    state: PlanarState
    reading: Reading


@kernel(is_inlined=True)
def drive_on(
    p: PlanarParameters, k: Constants, s: PlanarState, commands: Array, past: int, substeps: int, imu: Array
) -> Seen:
    """One control period straight ahead, and what sensors show at its end; arguments as of `hold`."""
    s = hold(p, k, s, commands, past, substeps, STRAIGHT, imu, EVEN)
    steps = (past + 1) * substeps
    return Seen(s, read_sensors(p, k, s, imu, steps, 0.0, steps * k.step))


class PlanarPlant(Plant):
    """A robot with effects that drives straight ahead, integrated by its own equations.

    The start pose of a trial follows from (seed, trial) as that of the robot in the physics engine does.

    Args:
        robot: data sheet.
        effects: what the data sheet leaves out. Of `SensorNoise` it takes the standard deviations; its noise is drawn
            from (seed, trial) too, but in an order of its own.
        start: where rollouts begin.
        physics_step: [s]; the one that is used is the longest that is no longer and divides the control period.
        seed: of all randomness.

    Raises:
        ConfigError: the physics step is not positive, the planar model has no such effect, or
            effects do not go together.
    """

    def __init__(
        self,
        *,
        robot: RobotParameters,
        effects: Sequence[Effect],
        start: StartPose,
        physics_step: float,
        seed: int,
    ) -> None:
        self.control_period, self.command_limit = robot.control_period, robot.torque_limit
        self._planar_model = planar_parameters(robot, values_of(effects))
        self._substeps = substeps(robot.control_period, physics_step)
        step = dividing_step(robot.control_period, physics_step)
        self._constants: Constants = constants(self._planar_model, step)
        noises = [astuple(effect) for effect in effects if isinstance(effect, SensorNoise)]
        self._noise = np.array(noises[0] if noises else [0.0] * 6)
        if self._constants.play.gap > 0 and self._constants.grip < UNBOUNDED:
            raise ConfigError("The planar model has no backlash on wheels that slip; leave one of the two effects out.")
        model = assemble(robot, effects)
        if part := swinging_part(model):
            without_part(model.robot, part)  # raises where that leaves no body
        self._start = start
        self._seed = seed
        self._reset_memory()

    def _reset_memory(self) -> None:
        ring = ring_length(self._constants, self._substeps)
        self._commands: list[float] = []
        self._state: PlanarState = standing(self._constants, 0.0, 0.0, 0.0, 0.0)
        self._imu = imu_settled(self._constants, self._state, ring)
        self._speed = 0.0

    def reset(self, trial: int) -> Observation:
        """Begin the rollout that (seed, trial) names."""
        self._rng = generator(Stream.SENSOR_NOISE, self._seed, trial)
        stance = self._start.draw(generator(Stream.START_POSE, self._seed, trial))
        self._reset_memory()
        self._state = standing(self._constants, stance.tilt, stance.tilt_rate, stance.speed, 0.0)
        self._imu = imu_settled(self._constants, self._state, len(self._imu))
        self._speed = stance.speed
        return self._observe(read_sensors(self._planar_model, self._constants, self._state, self._imu, 0, 0.0, 0.0))

    def step(self, command: float) -> Observation:
        """Hold the command, cut to the torque limit, for one control period.

        Raises:
            DataError: the command is not finite.
        """
        self._commands.append(clipped(command, self._planar_model.torque_limit))
        past = len(self._commands) - 1
        commands = np.array(self._commands)
        self._state, reading = drive_on(
            self._planar_model, self._constants, self._state, commands, past, self._substeps, self._imu
        )
        return self._observe(reading)

    def pose(self) -> Pose:
        """The true pose; it never leaves its line."""
        return Pose(self._state.position, 0.0, 0.0, self._state.tilt)

    def stop(self) -> None:
        """Nothing turns between the steps of a simulation."""

    def close(self) -> None:
        """Nothing is held."""

    def _observe(self, seen: Reading) -> Observation:
        time = len(self._commands) * self.control_period
        speed = self._constants.radius * self._state.wheel_speed + self._state.slip
        acceleration = (speed - self._speed) / self.control_period
        self._speed = speed
        values = [seen.tilt, seen.tilt_rate, acceleration, seen.wheel_angle, seen.wheel_rate, 0.0]
        noisy = np.array(values) + self._noise * self._rng.standard_normal(len(values))
        return Observation(time, *noisy.tolist())
