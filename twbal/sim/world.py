"""A PyBullet world with one robot on a plane.

PyBullet needs some care to roll a wheeled robot as mechanics says: sphere wheels (see `urdf_text`), the inertias of the
file, no damping of its own, motors freed, no slop in the contacts (or the robot falls 10 µm before the ground carries
it, and its wheels spin meanwhile), and the client's id on every call, or two worlds in a process meet.
"""

import tempfile
from math import atan2, cos, hypot, sin
from pathlib import Path
from typing import NamedTuple

from twbal.core.engine import Engine, Motion
from twbal.core.errors import ConfigError
from twbal.core.robot_model import JointMotion, Machine, Running
from twbal.core.robot_parameters import GRAVITY
from twbal.core.start_pose import InitialState
from twbal.sim.bullet import pybullet
from twbal.sim.gears import Gears
from twbal.sim.surroundings import Surroundings
from twbal.sim.urdf import urdf_text

_LARGEST_STEP = 0.001
_ALOFT = (0.0, 0.0, 100.0)
_RESIDUAL = 1e-12  # of the contact solver; at PyBullet's 1e-7 the robot yaws by itself at 0.1 mrad/s
_JOINTS, _SIDES = (0, 1), (-1.0, 1.0)  # left and right; a robot that turns to the left is faster on the right


class RestartState(NamedTuple):
    """What a robot in the middle of a rollout has beyond tilt, tilt rate and speed.

    Attributes:
        wheel_angle: relative to the body, mean of both wheels [rad].
        heading: by which it has turned since the rollout began, to the left [rad].
        slip: speed of the axle beyond that of wheels which roll [m/s].
        yaw_rate: [rad/s].
        position: of the axle since the rollout began [m].
        rotor_ahead: of the wheels, within a backlash [rad].
    """

    wheel_angle: float
    heading: float = 0.0
    slip: float = 0.0
    yaw_rate: float = 0.0
    position: float = 0.0
    rotor_ahead: float = 0.0


class World(Engine):
    """Integrates a machine by PyBullet.

    Coulomb friction is a velocity motor with target 0 and the friction torque as its largest force, viscous friction is
    joint damping, tyres that slip are a coefficient of friction, a slope is gravity that leans: all inside the engine.
    What the engine has no form for acts on it step by step: see `Gears` and `Surroundings`.

    Args:
        machine: the robot with its effects.
        physics_step: [s], at most 1 ms.

    Raises:
        ConfigError: the physics step is too long, or PyBullet has no world left.
    """

    def __init__(self, machine: Machine, physics_step: float) -> None:
        if not 0 < physics_step <= _LARGEST_STEP:
            raise ConfigError(
                f"PyBullet rolls wheels rightly at physics steps of at most {_LARGEST_STEP} s; found {physics_step} s."
            )
        self._machine = machine
        self._physics_step = physics_step
        self._gears = Gears(machine, physics_step)
        self._surroundings = Surroundings(machine, physics_step)
        self._client = pybullet.connect(pybullet.DIRECT)
        if self._client < 0:
            raise ConfigError("PyBullet has no world left in this process; close plants that are no longer used.")
        self._robot = self._fresh = -1  # the robot, and the state of the world as it was built
        self._vertical = (0.0, 0.0, 1.0)
        self._rate_before: float | None = None
        self._first_acceleration = 0.0

    def reset(self, initial: InitialState, heading: float = 0.0) -> None:
        """Put the robot into the world as it was built, wheels on the ground and rolling at the initial speed.

        Args:
            initial: tilt, tilt rate and speed.
            heading: by which it looks away from where a slope rises, to the left [rad].
        """
        client = self._client
        if self._fresh < 0:
            self._build()
        # Contacts are not a part of that state: they end where the robot is lifted off the ground.
        pybullet.resetBasePositionAndOrientation(self._robot, _ALOFT, [0, 0, 0, 1], physicsClientId=client)
        pybullet.performCollisionDetection(physicsClientId=client)
        pybullet.restoreState(stateId=self._fresh, physicsClientId=client)
        slope = self._machine.ground.slope  # the ground stays level and the vertical leans
        self._vertical = (sin(slope) * cos(heading), -sin(slope) * sin(heading), cos(slope))
        pybullet.setGravity(*(-GRAVITY * part for part in self._vertical), physicsClientId=client)
        self._place(initial)
        self._set_dry_friction(0.0)
        self._set_velocity(initial)
        self._gears.reset()
        self._surroundings.reset()
        self._rate_before, self._first_acceleration = None, 0.0

    def glide(self) -> float:
        """Take one physics step without torque and return the joints' acceleration in it [rad/s²]."""
        rate = self.motion().wheel_rate
        pybullet.stepSimulation(physicsClientId=self._client)
        return (self.motion().wheel_rate - rate) / self._physics_step

    def resume(self, restart: RestartState, time: float, acceleration: float = 0.0) -> None:
        """After a reset with its heading: be in the middle of a rollout.

        Args:
            restart: what that is beyond the initial state.
            time: since the rollout began [s].
            acceleration: of the joints without torque (`glide`) [rad/s²]; what turns with the gears feels it.
        """
        self._first_acceleration = acceleration
        client, radius, half = self._client, self._machine.robot.wheel_radius, 0.5 * self._machine.robot.track
        if restart.yaw_rate:
            ahead = self._ahead_of_axle()
            (x, y, z), (roll, pitch, yaw) = pybullet.getBaseVelocity(self._robot, physicsClientId=client)
            pybullet.resetBaseVelocity(
                self._robot,
                linearVelocity=[x, y + restart.yaw_rate * ahead, z],
                angularVelocity=[roll, pitch, yaw + restart.yaw_rate],
                physicsClientId=client,
            )
        for joint, side in zip(_JOINTS, _SIDES, strict=True):
            rate = pybullet.getJointState(self._robot, joint, physicsClientId=client)[1]
            rate += (side * half * restart.yaw_rate - restart.slip) / radius
            angle = restart.wheel_angle + side * half * restart.heading / radius
            pybullet.resetJointState(self._robot, joint, angle, rate, physicsClientId=client)
        self._gears.reset(restart.rotor_ahead)
        self._surroundings.reset(restart.position, time)

    def advance(self, command: float, running: Running, steps: int) -> None:
        """Take physics steps with half of the torque on each wheel's joint."""
        client, robot = self._client, self._robot
        drive, step, mode = pybullet.setJointMotorControlArray, pybullet.stepSimulation, pybullet.TORQUE_CONTROL
        forces = [0.5 * command] * 2
        filtered = bool(running.actuators)
        if self._gears.needed or self._surroundings.needed or running.joints:
            self._advance_with_care(command, running, steps)
            return
        for _ in range(steps):
            if filtered:
                forces = [0.5 * running.actuate(command)] * 2
            drive(robot, _JOINTS, mode, forces=forces, physicsClientId=client)
            step(physicsClientId=client)

    def _advance_with_care(self, command: float, running: Running, steps: int) -> None:
        """Take physics steps with all that must be told to the engine anew in each."""
        client, robot = self._client, self._robot
        for _ in range(steps):
            motion = self.motion()
            before = self._rate_before
            acceleration = (
                self._first_acceleration if before is None else (motion.wheel_rate - before) / self._physics_step
            )
            self._rate_before = motion.wheel_rate
            apart = self._apart() if running.joints else 0.0
            joint = JointMotion(motion.wheel_angle, motion.wheel_rate, acceleration, apart)
            torque = running.turn(running.actuate(command), joint)
            if self._gears.friction_changes:
                self._set_dry_friction(motion.wheel_rate)
            passed = self._gears.pass_on(torque, motion)
            pybullet.setJointMotorControlArray(
                robot, _JOINTS, pybullet.TORQUE_CONTROL, forces=[0.5 * passed] * 2, physicsClientId=client
            )
            if passed != torque:  # the motors push themselves off the body, whatever their rotors meet
                self._turn(-1, passed - torque)
            around = self._surroundings.act(motion)
            if around.on_wheels:
                for wheel in _JOINTS:
                    self._turn(wheel, 0.5 * around.on_wheels)
            if around.at_axle:
                self._push(around.at_axle)
            pybullet.stepSimulation(physicsClientId=client)

    def _turn(self, link: int, torque: float) -> None:
        """Turn a link about the axle from outside [N·m], positive forward."""
        axis = self._left()
        pybullet.applyExternalTorque(
            self._robot,
            link,
            torqueObj=[torque * part for part in axis],
            flags=pybullet.WORLD_FRAME,
            physicsClientId=self._client,
        )

    def _push(self, force: float) -> None:
        """Push the axle forward along the ground [N]."""
        left = self._left()
        level = hypot(left[0], left[1])
        place, orientation = pybullet.getBasePositionAndOrientation(self._robot, physicsClientId=self._client)
        r = pybullet.getMatrixFromQuaternion(orientation)
        lx, lz = self._arm()
        axle = [p - lx * r[3 * i] - lz * r[3 * i + 2] for i, p in enumerate(place)]
        pybullet.applyExternalForce(
            self._robot,
            -1,
            forceObj=[force * left[1] / level, -force * left[0] / level, 0],
            posObj=axle,
            flags=pybullet.WORLD_FRAME,
            physicsClientId=self._client,
        )

    def _left(self) -> tuple[float, float, float]:
        """The body's y axis in the world."""
        _, orientation = pybullet.getBasePositionAndOrientation(self._robot, physicsClientId=self._client)
        r = pybullet.getMatrixFromQuaternion(orientation)
        return r[1], r[4], r[7]

    def _apart(self) -> float:
        """By which the right wheel is ahead of the mean of both and the left one behind it [rad]."""
        left, right = pybullet.getJointStates(self._robot, _JOINTS, physicsClientId=self._client)
        return float(0.5 * (right[0] - left[0]))

    def _ahead_of_axle(self) -> float:
        """Distance of the centre of mass ahead of the axle, along the ground [m]."""
        _, orientation = pybullet.getBasePositionAndOrientation(self._robot, physicsClientId=self._client)
        r = pybullet.getMatrixFromQuaternion(orientation)
        lx, lz = self._arm()
        return float(lx * hypot(r[0], r[3]) + lz * (r[2] * r[0] + r[5] * r[3]) / hypot(r[0], r[3]))

    def _arm(self) -> tuple[float, float]:
        """From the axle to the centre of mass, in the body's x and z [m]."""
        robot = self._machine.robot
        return robot.com_height * sin(robot.com_offset), robot.com_height * cos(robot.com_offset)

    def motion(self) -> Motion:
        """Read the motion off the base and the joints."""
        client, robot = self._client, self._robot
        _, orientation = pybullet.getBasePositionAndOrientation(robot, physicsClientId=client)
        velocity, spin = pybullet.getBaseVelocity(robot, physicsClientId=client)
        r = pybullet.getMatrixFromQuaternion(orientation)  # rotation body to world, row by row
        forward, left, up = (r[0], r[3], r[6]), (r[1], r[4], r[7]), (r[2], r[5], r[8])
        level = hypot(forward[0], forward[1])
        lx, lz = self._arm()
        arm = [lx * f + lz * u for f, u in zip(forward, up, strict=True)]  # axle to centre of mass, world
        axle_x = velocity[0] - (spin[1] * arm[2] - spin[2] * arm[1])
        axle_y = velocity[1] - (spin[2] * arm[0] - spin[0] * arm[2])
        wheels = pybullet.getJointStates(robot, _JOINTS, physicsClientId=client)
        return Motion(
            tilt=atan2(-_dot(self._vertical, forward), _dot(self._vertical, up)),
            tilt_rate=sum(w * e for w, e in zip(spin, left, strict=True)),
            speed=(axle_x * forward[0] + axle_y * forward[1]) / level,
            wheel_angle=(wheels[0][0] + wheels[1][0]) / 2,
            wheel_rate=(wheels[0][1] + wheels[1][1]) / 2,
            yaw_rate=spin[2],
        )

    def close(self) -> None:
        """Disconnect from PyBullet."""
        if self._client >= 0:
            pybullet.disconnect(physicsClientId=self._client)
        self._client = -1

    def _rising(self) -> float:
        """By how much the ground rises ahead at the start [rad]."""
        return atan2(self._vertical[0], self._vertical[2])

    def _build(self) -> None:
        """Lay the ground, load the robot and keep that state: to restore it takes a hundredth of the time."""
        client = self._client
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self._physics_step,
            deterministicOverlappingPairs=1,
            contactSlop=0,
            solverResidualThreshold=_RESIDUAL,
            physicsClientId=client,
        )
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
        ground = pybullet.createMultiBody(0, plane, physicsClientId=client)
        pybullet.changeDynamics(ground, -1, lateralFriction=1, physicsClientId=client)
        with tempfile.TemporaryDirectory() as folder:  # PyBullet reads URDF from files only
            path = Path(folder) / "robot.urdf"
            path.write_text(urdf_text(self._gears.robot))
            flags = pybullet.URDF_USE_INERTIA_FROM_FILE
            self._robot = int(pybullet.loadURDF(str(path), flags=flags, physicsClientId=client))
        self._set_dynamics()
        self._fresh = pybullet.saveState(physicsClientId=client)

    def _place(self, initial: InitialState) -> None:
        """Put the axle one wheel radius above the ground, and the body at its tilt."""
        lean = initial.tilt + self._rising()  # from the ground's normal
        lx, lz = self._arm()
        # PyBullet's base is the centre of mass: so far ahead of the axle, and above it.
        ahead, above = lx * cos(lean) + lz * sin(lean), lz * cos(lean) - lx * sin(lean)
        pybullet.resetBasePositionAndOrientation(
            self._robot,
            [ahead, 0, self._machine.robot.wheel_radius + above],
            [0, sin(lean / 2), 0, cos(lean / 2)],
            physicsClientId=self._client,
        )

    def _set_dynamics(self) -> None:
        """Take away PyBullet's own damping and motors, and put in the drive's friction."""
        drive = self._machine.drive
        grip = min(self._machine.ground.grip, 1.0)
        for link in (-1, *_JOINTS):
            pybullet.changeDynamics(
                self._robot,
                link,
                linearDamping=0,
                angularDamping=0,
                jointDamping=drive.viscous_friction,
                lateralFriction=grip,
                spinningFriction=0,
                rollingFriction=0,
                restitution=0,
                physicsClientId=self._client,
            )

    def _set_dry_friction(self, rate: float) -> None:
        """Tell the joints' motors how far they may hold, at a rate of the wheels relative to the body [rad/s]."""
        for joint in _JOINTS:
            pybullet.setJointMotorControl2(
                self._robot,
                joint,
                pybullet.VELOCITY_CONTROL,
                targetVelocity=0,
                force=self._machine.drive.dry_friction(rate),
                physicsClientId=self._client,
            )

    def _set_velocity(self, initial: InitialState) -> None:
        """Velocity of the centre of mass (PyBullet's base) and rates of the wheels, such that the wheels roll."""
        robot = self._machine.robot
        lean = initial.tilt + robot.com_offset + self._rising()
        pybullet.resetBaseVelocity(
            self._robot,
            linearVelocity=[
                initial.speed + robot.com_height * cos(lean) * initial.tilt_rate,
                0,
                -robot.com_height * sin(lean) * initial.tilt_rate,
            ],
            angularVelocity=[0, initial.tilt_rate, 0],
            physicsClientId=self._client,
        )
        rate = initial.speed / robot.wheel_radius - initial.tilt_rate
        for joint in _JOINTS:
            pybullet.resetJointState(self._robot, joint, 0, rate, physicsClientId=self._client)


def _dot(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
