"""The robot in PyBullet from the middle of a recording on, under recorded commands."""

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from twbal.core.engine import dividing_step, substeps
from twbal.core.errors import DataError
from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.core.robot_model import EffectState, RobotModel
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import InitialState
from twbal.effects.effect import Effect, assemble
from twbal.effects.gyro_bias_walk import GyroBiasWalk
from twbal.effects.lost_commands import LostCommands
from twbal.effects.sensor_noise import SensorNoise
from twbal.sim.restart_state import RestartState
from twbal.sim.world import World

_LEFT_OUT = (SensorNoise, GyroBiasWalk, LostCommands)


@dataclass(frozen=True, eq=False)
class ReplayStart:
    """The motion of a robot at one instant of a recording, with what its effects remember.

    Attributes:
        initial: tilt [rad], tilt rate [rad/s] and speed [m/s].
        restart: wheels, turning, and where in the recording it is.
        past_commands: (t, k) or (t,) all commands since the recording began, in equal parts of each period or of whole
            ones [N·m]: they fill delays and lags and drain batteries.
        past_motion: (k, 3) tilt, tilt rate and speed at the k instants before, oldest first: a late IMU still shows
            them, and they have misled a filter of the tilt.
        yaw_rates: (S + 1,) of the robot from the start on [rad/s]: it turns as it did, as what turned it is no part of
            the commands; empty: it turns freely.
    """

    initial: InitialState
    restart: RestartState
    past_commands: Array
    past_motion: Array
    yaw_rates: Array = field(default_factory=lambda: np.zeros(0))


def replay(
    robot: RobotParameters,
    effects: Sequence[Effect],
    physics_step: float,
    starts: Sequence[ReplayStart],
    commands: Array,
) -> Array:
    """What the sensors show, without noise, after each start under recorded commands, (n, S + 1, 7).

    Args:
        robot: data sheet.
        effects: of the simulation; noise of the sensors is left out, as is a bias that walks, and lost commands:
            recorded ones acted.
        physics_step: upper bound of the one that is used, which divides each part of a period [s].
        starts: n motions.
        commands: (n, S, k) of k equal parts of each period, or (n, S) of whole ones [N·m].

    Raises:
        ConfigError: the physics step is not positive, or too long.
        DataError: there is not one row of commands for each start.
    """
    if len(starts) != len(commands):
        raise DataError(f"A replay needs commands for each of {len(starts)} starts; found {len(commands)}.")
    parts = np.shape(commands)[2] if np.ndim(commands) == 3 else 1
    physics_step = dividing_step(robot.control_period / parts, physics_step)
    model = assemble(robot, [effect for effect in effects if not isinstance(effect, _LEFT_OUT)])
    world = World(model, physics_step)
    actuated = _Actuated(model, physics_step)
    try:
        courses = [
            _course(world, model, physics_step, start, _in_parts(held), actuated)
            for start, held in zip(starts, commands, strict=True)
        ]
    finally:
        world.close()
    return np.array(courses)


class _Actuated:
    """The torques that actuators make of recorded commands, made once for all starts in a recording.

    Actuators know of commands alone, so what a delay or a battery remembers at a start is what it came to on the way.
    """

    def __init__(self, model: RobotModel, physics_step: float) -> None:
        self._model, self._physics_step = model, physics_step
        self._effect_state = self._fresh()
        self._commands, self._torques = np.zeros(0), list[float]()  # so far

    def torques(self, past: Array, held: Array, steps: int) -> Iterator[float]:
        """Of each physics step.

        Args:
            past: (t,) all commands before [N·m].
            held: (S,) the next ones [N·m].
            steps: physics steps for which each of them is held.
        """
        commands = np.concatenate([past, held])
        known = min(len(self._commands), len(commands))
        if not np.array_equal(self._commands[:known], commands[:known]):  # another recording
            self._effect_state, self._commands, self._torques = self._fresh(), np.zeros(0), []
        for command in map(self._model.clip, commands[len(self._commands) :]):
            self._torques += [self._effect_state.actuate(command) for _ in range(steps)]
        self._commands = max(self._commands, commands, key=len)
        return iter(self._torques[len(past) * steps : len(commands) * steps])

    def _fresh(self) -> EffectState:
        return self._model.start(self._physics_step, np.random.default_rng(0))


def _in_parts(commands: Array) -> Array:
    """Commands (S, k), of k equal parts of each period, or (S,), which are held."""
    return commands if commands.ndim == 2 else commands[:, None]


def _course(
    world: World, model: RobotModel, physics_step: float, start: ReplayStart, commands: Array, actuated: _Actuated
) -> list[Observation]:
    """The observations after one start under commands (S, k)."""
    period = model.robot.control_period
    steps = substeps(period / commands.shape[1], physics_step)
    effect_state = _remembering(model, physics_step, start)
    if any(actuator.remembers for actuator in model.actuators):
        torques = actuated.torques(_in_parts(start.past_commands).ravel(), commands.ravel(), steps)
        effect_state = dataclasses.replace(effect_state, actuators=(lambda _: next(torques),))
    time = len(start.past_commands) * period
    world.reset(start.initial, start.restart.heading)
    world.resume(start.restart, time)
    speed = float(start.past_motion[-1, 2]) if len(start.past_motion) else world.motion().speed
    seen = []
    for i in range(len(commands) + 1):
        if i:
            if len(start.yaw_rates):
                world.turn_at(0.5 * float(start.yaw_rates[i - 1] + start.yaw_rates[i]))
            for command in commands[i - 1].tolist():
                world.advance(model.clip(command), effect_state, steps)
        now = world.motion()
        truth = Observation(
            time=time + i * period,
            tilt=now.tilt,
            tilt_rate=now.tilt_rate,
            acceleration=(now.speed - speed) / period,
            wheel_angle=now.wheel_angle,
            wheel_rate=now.wheel_rate,
            yaw_rate=now.yaw_rate,
        )
        speed = now.speed
        seen.append(effect_state.sense(truth))
    return seen


def _remembering(model: RobotModel, physics_step: float, start: ReplayStart) -> EffectState:
    """Sensors as the motion before the start left them, and fresh actuators."""
    effect_state = model.start(physics_step, np.random.default_rng(0))
    before = float(start.past_motion[0, 2]) if len(start.past_motion) else 0.0
    for tilt, rate, speed in start.past_motion.tolist() if effect_state.sensors else ():
        effect_state.sense(Observation(0.0, tilt, rate, (speed - before) / model.robot.control_period, 0.0, 0.0, 0.0))
        before = speed
    return effect_state
