"""The robot in PyBullet from the middle of a recording on, under recorded commands."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twbal.core.engine import substeps
from twbal.core.errors import DataError
from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.core.robot_model import Machine, Running
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import InitialState
from twbal.effects.effect import Effect, assemble
from twbal.effects.sensor_noise import SensorNoise
from twbal.sim.restart_state import RestartState
from twbal.sim.world import World


@dataclass(frozen=True, eq=False)
class ReplayStart:
    """The motion of a robot at one instant of a recording, with what its effects remember.

    Attributes:
        initial: tilt [rad], tilt rate [rad/s] and speed [m/s].
        restart: wheels, turning, and where in the recording it is.
        past_commands: (t,) all commands since the recording began [N·m]: they fill delays and lags and drain batteries.
        past_motion: (k, 3) tilt, tilt rate and speed at the k instants before, oldest first: a late IMU still shows
            them, and they have misled a filter of the tilt.
    """

    initial: InitialState
    restart: RestartState
    past_commands: Array
    past_motion: Array


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
        effects: of the simulation; noise of the sensors is left out.
        physics_step: [s].
        starts: n motions.
        commands: (n, S) [N·m].

    Raises:
        ConfigError: the physics step does not divide the control period.
        DataError: there is not one row of commands for each start.
    """
    if len(starts) != len(commands):
        raise DataError(f"A replay needs commands for each of {len(starts)} starts; found {len(commands)}.")
    machine = assemble(robot, [effect for effect in effects if not isinstance(effect, SensorNoise)])
    world = World(machine, physics_step)
    steps = substeps(robot.control_period, physics_step)
    try:
        courses = [
            _course(world, machine, physics_step, steps, start, held)
            for start, held in zip(starts, commands, strict=True)
        ]
    finally:
        world.close()
    return np.array(courses)


def _course(
    world: World, machine: Machine, physics_step: float, steps: int, start: ReplayStart, commands: Array
) -> list[Observation]:
    """The observations after one start."""
    period = machine.robot.control_period
    running = _remembering(machine, physics_step, steps, start)
    time = len(start.past_commands) * period
    world.reset(start.initial, start.restart.heading)
    acceleration = 0.0
    if running.joints:
        acceleration = world.glide()
        world.reset(start.initial, start.restart.heading)
    world.resume(start.restart, time, acceleration)
    speed = float(start.past_motion[-1, 2]) if len(start.past_motion) else world.motion().speed
    seen = []
    for i in range(len(commands) + 1):
        if i:
            world.advance(machine.clip(commands[i - 1]), running, steps)
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
        seen.append(running.sense(truth))
    return seen


def _remembering(machine: Machine, physics_step: float, steps: int, start: ReplayStart) -> Running:
    """Actuators and sensors as the commands and the motion before the start left them."""
    running = machine.start(physics_step, np.random.default_rng(0))
    if any(actuator.remembers for actuator in machine.actuators):
        for command in map(machine.clip, start.past_commands):
            for _ in range(steps):
                running.actuate(command)
    before = float(start.past_motion[0, 2]) if len(start.past_motion) else 0.0
    for tilt, rate, speed in start.past_motion.tolist() if running.sensors else ():
        running.sense(Observation(0.0, tilt, rate, (speed - before) / machine.robot.control_period, 0.0, 0.0, 0.0))
        before = speed
    return running
