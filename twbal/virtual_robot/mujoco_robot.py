"""The robot behind the port: MuJoCo's physics with a drive and sensors of its own."""

import mujoco
import numpy as np

from twbal.core.engine import dividing_step, substeps
from twbal.core.plant import Observation, Plant, Pose, WheelDifference
from twbal.core.start_pose import InitialState, StartPose
from twbal.core.streams import Stream, generator
from twbal.virtual_robot.ground_truth import GroundTruth
from twbal.virtual_robot.mjcf import mjcf
from twbal.virtual_robot.physics import BodyMotion, Buffers, drive_steps, encoders, present_motion
from twbal.virtual_robot.placement import place
from twbal.virtual_robot.readout import Readout
from twbal.virtual_robot.robot_constants import Memory, constants, fresh_memory

_NEARLY = 1e-9  # of a physics step: a time that is a whole number of them is not rounded down


class MujocoRobot(Plant):
    """A robot that is what its ground truth says. Nothing of it is shared with what learns to drive it.

    Args:
        truth: what it is.
        control_period: [s].
        start: where rollouts begin.
        physics_step: [s]; the one that is used is the longest that is no longer and divides the control period.
        seed: of start poses and noise.

    Attributes:
        push: force at the axle, forward, until it is set to something else [N]; a new rollout begins without.

    Raises:
        ConfigError: the physics step is not positive.
    """

    turns = True

    def __init__(
        self, *, truth: GroundTruth, control_period: float, start: StartPose, physics_step: float, seed: int
    ) -> None:
        self.control_period = control_period
        self.truth = truth
        self._steps = substeps(control_period, physics_step)
        step = dividing_step(control_period, physics_step)
        self._start, self._seed = start, seed
        self._constants = constants(truth, step, control_period)
        self._model = mujoco.MjModel.from_xml_string(mjcf(truth, step))
        self._data = data = mujoco.MjData(self._model)
        self._buffers = Buffers(
            self._model._address, data._address, data.qpos, data.qvel, data.qfrc_applied, data.xfrc_applied
        )
        self._memory: Memory
        self._motion: BodyMotion
        self.reset(0)  # the first of all compiles, which takes seconds: now, and not while a host waits
        drive_steps(self._constants, self._memory, self._buffers, 0, 0, 0, 0.0, 0.0)

    def reset(self, trial: int) -> Observation:
        """Begin the rollout that (seed, trial) names."""
        self.push = self._difference = 0.0
        self._periods = self._done = 0
        self._readout = Readout(
            self.truth.sensors,
            self.control_period,
            generator(Stream.SENSOR_NOISE, self._seed, trial),
            generator(Stream.SENSOR_NOISE, self._seed, trial, 1),
        )
        self._torque_rng = generator(Stream.TORQUE_NOISE, self._seed, trial)
        self._put(self._start.draw(generator(Stream.START_POSE, self._seed, trial)))
        self._draw_torque()
        self._speed_before = self._motion.speed
        return self._observe(self._motion.speed)

    def step(self, command: float) -> Observation:
        """Hold the command and the difference, each cut to the torque limit, for one control period."""
        self._drive(command, self._steps)
        self._periods, self._done = self._periods + 1, 0
        self._readout.let_bias_walk()
        self._draw_torque()
        seen = self._observe(self._speed_before)
        self._speed_before = self._motion.speed
        return seen

    def drive_until(self, time: float, command: float) -> None:
        """Drive a part of a control period by whole physics steps; see `Plant.drive_until`."""
        self._drive(command, min(int(time / self._constants.step + _NEARLY), self._steps))

    def _drive(self, command: float, end: int) -> None:
        """Drive with the command and the difference, each cut to the limit, up to a physics step of the period."""
        c, m, limit = self._constants, self._memory, self.truth.drive.torque_limit
        place = self._periods % len(m.commands)
        asked = min(max(float(command), -limit), limit), min(max(self._difference, -limit), limit)
        if not self._done:
            m.begins[place], m.earlier_count[place] = 0.0, 0
        elif asked != (m.commands[place], m.differences[place]):
            self._keep_earlier(place)
            m.begins[place] = self._done * c.step
        m.commands[place], m.differences[place] = asked
        if end > self._done:
            self._motion = drive_steps(
                c, m, self._buffers, self._periods, self._done, end, self._readout.bias, self.push
            )
            self._done = end

    def _keep_earlier(self, place: int) -> None:
        """Keep the last command of the period beside another one that comes, unless nothing was driven by it."""
        m, count, before = self._memory, self._memory.earlier_count[place], (place - 1) % len(self._memory.commands)
        is_new = (m.commands[place], m.differences[place]) != (m.commands[before], m.differences[before])
        if m.begins[place] < self._done * self._constants.step and (count or m.begins[place] or is_new):
            m.earlier_commands[place, count] = m.commands[place]
            m.earlier_differences[place, count] = m.differences[place]
            m.earlier_begins[place, count] = m.begins[place]
            m.earlier_count[place] += 1

    def _draw_torque(self) -> None:
        """The random torque on each shaft in the control period that begins."""
        deviation = 0.5 * self.truth.drive.torque_noise
        if deviation > 0.0:
            self._memory.random_torque[0] = deviation * self._torque_rng.standard_normal()

    def steer(self, difference: float) -> None:
        """Set the difference of the wheel torques [N·m]; see `Plant.steer`."""
        self._difference = float(difference)

    def wheel_difference(self) -> WheelDifference:
        """What both encoders show, and their noise."""
        shown, rates = self._encoders()
        noise = self._readout.difference_noise
        return WheelDifference(float(shown[1] - shown[0]) + noise[0], float(rates[1] - rates[0]) + noise[1])

    def pose(self) -> Pose:
        """The true one."""
        x, y = self._data.qpos[:2]
        return Pose(float(x), float(y), self._motion.heading, self._motion.tilt)

    @property
    def true_motion(self) -> BodyMotion:
        """How it moves, whatever its sensors show."""
        return self._motion

    @property
    def wheel_angles(self) -> np.ndarray:
        """(2,) of the wheels, relative to the body [rad]."""
        return np.array(self._data.qpos[7:9])

    def stop(self) -> None:
        """Nothing turns between the steps of a simulation."""

    def close(self) -> None:
        """Nothing is held."""

    def _put(self, initial: InitialState) -> None:
        """Put the robot down, its wheels rolling, its filters settled."""
        c, data, sensors = self._constants, self._data, self.truth.sensors
        mujoco.mj_resetData(self._model, data)
        place(data.qpos, data.qvel, self.truth.body, c.slope, initial)
        self._motion = present_motion(self._buffers, c.slope)
        self._memory = m = fresh_memory(c)
        m.rotor[:], m.rotor_rate[:] = data.qpos[7:9], data.qvel[6:8]
        m.counted[:] = encoders(c, m._replace(rotor=m.rotor - c.window * c.step * m.rotor_rate), self._turned_back())
        settled = self._motion.tilt + self._readout.bias * sensors.fusion_time
        m.imu[:] = self._motion.speed, settled, settled, self._motion.tilt_rate + self._readout.bias

    def _turned_back(self) -> np.ndarray:
        """(9,) `qpos` as it was a window of the encoders before, at the present rates."""
        back = np.array(self._data.qpos)
        back[7:9] -= self._constants.window * self._constants.step * self._data.qvel[6:8]
        return back

    def _observe(self, speed_before: float) -> Observation:
        m, (shown, rates) = self._memory, self._encoders()
        seen = Observation(
            time=self._periods * self.control_period,
            tilt=float(m.imu[2]),
            tilt_rate=float(m.imu[3]),
            acceleration=(self._motion.speed - speed_before) / self.control_period,
            wheel_angle=0.5 * (shown[0] + shown[1]),
            wheel_rate=float(0.5 * (rates[0] + rates[1])),
            yaw_rate=self._motion.yaw_rate,
        )
        return self._readout.show(seen)

    def _encoders(self) -> tuple[tuple[float, float], np.ndarray]:
        """Angles and rates that both encoders show [rad], [rad/s]."""
        c, m = self._constants, self._memory
        shown = encoders(c, m, self._data.qpos)
        rates = m.rotor_rate if c.is_encoder_on_motor and c.rotor else self._data.qvel[6:8]
        return shown, (np.array(shown) - m.counted) / (c.window * c.step) if c.window else rates
