"""The robot in a world of PyBullet: how it is put somewhere, what acts on it, and how it moves.

PyBullet needs some care to roll a wheeled robot as mechanics says: sphere wheels (see `urdf_text`), the inertias of the
file, no damping of its own, and motors freed.
"""

from collections.abc import Sequence
from functools import partial
from math import atan2, cos, hypot, isfinite, sin

from twbal.core.engine import RobotMotion
from twbal.core.plant import Pose
from twbal.core.robot_model import RobotModel
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import InitialState
from twbal.core.swinging_part import SwingingPart
from twbal.sim.bullet import Client, pybullet
from twbal.sim.restart_state import RestartState
from twbal.sim.urdf import urdf_text

_ALOFT = (0.0, 0.0, 100.0)
_BODY, _WHEELS, _PART = -1, (0, 1), 2  # links; the joint of a wheel, or of what swings, has its number
_LINK, _NORMAL_FORCE = 3, 9  # of a contact point
_SIDES = (-1.0, 1.0)  # left and right; a robot that turns to the left is faster on the right
_FASTEST = 1e6
"""Rate at which joints and body are cut [rad/s], far beyond any that a robot has; PyBullet's own bound is 100."""


Vector = tuple[float, float, float]
"""In the world: x ahead of the robot as it was loaded, y to its left, z up."""


class BulletRobot:
    """A robot that is loaded into a world. PyBullet's base is the body's centre of mass.

    Coulomb friction is a velocity motor with target 0 and the friction torque as its largest force, viscous friction is
    joint damping, tyres that slip are a coefficient of friction.

    Args:
        client: the world.
        robot: masses and lengths, without the part that swings.
        model: friction of its joints and the grip of its tyres.
        part: of the body that swings; None where nothing does.
        geared: inertia by which the body is harder to pitch than masses on it make it [kg·m²].
    """

    def __init__(
        self,
        client: Client,
        robot: RobotParameters,
        model: RobotModel,
        part: SwingingPart | None = None,
        geared: float = 0.0,
    ) -> None:
        self._part = part
        self._client, self._robot, self._drive = client, robot, model.drive
        self._shares = [0.5 * (1.0 + side * model.drive.imbalance) for side in _SIDES]  # of the motors' torque
        height, offset = robot.com_height, robot.com_offset
        self._arm = height * sin(offset), height * cos(offset)  # axle to centre of mass, in the body's x and z [m]
        self._id = client.load(urdf_text(robot, part), {}, pybullet.URDF_USE_INERTIA_FROM_FILE)
        self._control = partial(client.setJointMotorControlArray, self._id, _WHEELS, pybullet.TORQUE_CONTROL)
        for link in (_BODY, *_WHEELS, *((_PART,) if part else ())):
            client.changeDynamics(
                self._id,
                link,
                linearDamping=0,
                angularDamping=0,
                jointDamping=0 if link == _PART else model.drive.viscous_friction,
                lateralFriction=min(model.ground.grip, 1.0),
                spinningFriction=0,
                rollingFriction=0,
                restitution=0,
            )
        client.changeDynamics(self._id, _BODY, maxJointVelocity=_FASTEST)  # PyBullet ignores what else is in its call

        if geared:  # after the URDF, in which no body may have that
            pitch = robot.body_inertia_pitch + geared
            inertias = [robot.body_inertia_roll, pitch, robot.body_inertia_yaw]
            client.changeDynamics(self._id, _BODY, localInertiaDiagonal=inertias)

    def let_slip(self) -> None:
        """Take all friction along their way from the tyres; what is across it stays."""
        for wheel in _WHEELS:
            self._client.changeDynamics(self._id, wheel, anisotropicFriction=[0, 1, 0])

    def load(self) -> float:
        """Force of the ground on the wheels in the last physics step, upwards [N]; 0 before the first."""
        points = self._client.getContactPoints(self._id)
        return float(sum(point[_NORMAL_FORCE] for point in points if point[_LINK] in _WHEELS))

    def is_lost(self) -> bool:
        """Whether its motion is no number any more."""
        return not all(map(isfinite, self._client.getBaseVelocity(self._id)[0]))

    def lift(self) -> None:
        """Take the robot off the ground, which ends its contacts."""
        self._client.resetBasePositionAndOrientation(self._id, _ALOFT, [0, 0, 0, 1])

    def place(self, initial: InitialState, rising: float) -> None:
        """Put the wheels on the ground, rolling at the initial speed, and the body at its tilt.

        Args:
            initial: tilt, tilt rate and speed.
            rising: angle by which the ground rises ahead [rad].
        """
        robot, (lx, lz) = self._robot, self._arm
        lean = initial.tilt + rising  # from the ground's normal
        ahead, above = lx * cos(lean) + lz * sin(lean), lz * cos(lean) - lx * sin(lean)  # centre of mass from axle
        self._client.resetBasePositionAndOrientation(
            self._id, [ahead, 0, robot.wheel_radius + above], [0, sin(lean / 2), 0, cos(lean / 2)]
        )
        lean = initial.tilt + robot.com_offset + rising
        forward = initial.speed + robot.com_height * cos(lean) * initial.tilt_rate
        up = -robot.com_height * sin(lean) * initial.tilt_rate
        self._client.resetBaseVelocity(
            self._id, linearVelocity=[forward, 0, up], angularVelocity=[0, initial.tilt_rate, 0]
        )
        for wheel in _WHEELS:
            self._client.resetJointState(self._id, wheel, 0, initial.speed / robot.wheel_radius - initial.tilt_rate)
        if self._part:  # a motor of the engine's own would hold it
            self._client.resetJointState(self._id, _PART, 0, 0)
            self._client.setJointMotorControl2(self._id, _PART, pybullet.VELOCITY_CONTROL, force=0)

    def restart(self, state: RestartState) -> None:
        """After `place`: take on what a robot in the middle of a rollout has besides."""
        radius, half = self._robot.wheel_radius, 0.5 * self._robot.track
        for wheel, side in zip(_WHEELS, _SIDES, strict=True):
            rate = self._client.getJointState(self._id, wheel)[1] - state.slip / radius
            angle = state.wheel_angle + side * half * state.heading / radius
            self._client.resetJointState(self._id, wheel, angle, rate)
        self.turn_at(state.yaw_rate)
        if self._part:
            self._client.resetJointState(self._id, _PART, state.sway, state.sway_rate)

    def turn_at(self, yaw_rate: float) -> None:
        """Turn at a rate from now on, to the left [rad/s]; the wheels go on to roll, and all else stays."""
        (x, y, z), (roll, pitch, yaw) = self._client.getBaseVelocity(self._id)
        change = yaw_rate - yaw
        if change == 0.0:
            return
        _, r = self._pose()
        level = hypot(r[1], r[4])
        across = change * self._ahead_of_axle() / level
        self._client.resetBaseVelocity(
            self._id,
            linearVelocity=[x + across * r[1], y + across * r[4], z],
            angularVelocity=[roll, pitch, yaw_rate],
        )
        by = 0.5 * self._robot.track * change / self._robot.wheel_radius
        for wheel, side in zip(_WHEELS, _SIDES, strict=True):
            angle, rate, *_ = self._client.getJointState(self._id, wheel)
            self._client.resetJointState(self._id, wheel, angle, rate + side * by)

    def hold(self) -> None:
        """Let each joint hold as far as dry friction does at the rate of its wheel relative to the body.

        Friction that grows over an angle is a torque of its own (`presliding.Bristles`).
        """
        for wheel, (_, rate, *_) in zip(_WHEELS, self._client.getJointStates(self._id, _WHEELS), strict=True):
            force = 0.0 if self._drive.presliding else self._drive.dry_friction(rate)
            self._client.setJointMotorControl2(
                self._id, wheel, pybullet.VELOCITY_CONTROL, targetVelocity=0, force=force
            )

    def drive(self, torque: float, friction: tuple[float, float] = (0.0, 0.0)) -> None:
        """Give the joints their shares of a torque for the next physics step [N·m].

        Args:
            torque: of the motors.
            friction: torques in the left joint and in the right one beside that.
        """
        self._control(forces=[share * torque + own for share, own in zip(self._shares, friction, strict=True)])

    def swing(self) -> None:
        """Let the spring of the part that swings act for the next physics step; needed where there is one."""
        if self._part:
            sway, rate, *_ = self._client.getJointState(self._id, _PART)
            force = self._part.force(sway, rate)
            self._client.setJointMotorControl2(self._id, _PART, pybullet.TORQUE_CONTROL, force=force)

    def turn_body(self, torque: float) -> None:
        """Turn the body about the axle from outside for the next physics step [N·m], positive forward."""
        self._turn([_BODY], torque)

    def turn_wheels(self, torque: float) -> None:
        """Turn the wheels from outside for the next physics step [N·m], positive forward."""
        self._turn(_WHEELS, 0.5 * torque)

    def push(self, force: float) -> None:
        """Push the axle forward along the ground for the next physics step [N]."""
        _, r = self._pose()
        level, axle = hypot(r[1], r[4]), self._axle()
        ahead = [force * r[4] / level, -force * r[1] / level, 0]
        self._client.applyExternalForce(self._id, _BODY, forceObj=ahead, posObj=axle, flags=pybullet.WORLD_FRAME)

    def motion(self, vertical: Vector) -> RobotMotion:
        """Read the motion off the base and the joints.

        Args:
            vertical: unit vector from which the tilt counts.
        """
        _, r = self._pose()
        velocity, spin = self._client.getBaseVelocity(self._id)
        forward, left, up = r[0::3], r[1::3], r[2::3]
        level = hypot(forward[0], forward[1])
        lx, lz = self._arm
        arm = [lx * f + lz * u for f, u in zip(forward, up, strict=True)]  # axle to centre of mass, world
        axle_x = velocity[0] - (spin[1] * arm[2] - spin[2] * arm[1])
        axle_y = velocity[1] - (spin[2] * arm[0] - spin[0] * arm[2])
        wheels = self._client.getJointStates(self._id, _WHEELS)
        return RobotMotion(
            tilt=atan2(-_dot(vertical, forward), _dot(vertical, up)),
            tilt_rate=sum(w * e for w, e in zip(spin, left, strict=True)),
            speed=(axle_x * forward[0] + axle_y * forward[1]) / level,
            wheel_angle=(wheels[0][0] + wheels[1][0]) / 2,
            wheel_rate=(wheels[0][1] + wheels[1][1]) / 2,
            yaw_rate=spin[2],
        )

    def pose(self, vertical: Vector) -> Pose:
        """Where the middle of the axle is, from where `place` put it, and how the body stands.

        Args:
            vertical: unit vector from which the tilt counts.
        """
        _, r = self._pose()
        x, y, _ = self._axle()
        forward, left, up = r[0::3], r[1::3], r[2::3]
        tilt = atan2(-_dot(vertical, forward), _dot(vertical, up))
        return Pose(x, y, atan2(-left[0], left[1]), tilt)

    def apart(self) -> tuple[float, float]:
        """By which the right wheel is ahead of the mean of both and the left one behind it [rad], and its rate."""
        left, right = self._client.getJointStates(self._id, _WHEELS)
        return float(0.5 * (right[0] - left[0])), float(0.5 * (right[1] - left[1]))

    def _turn(self, links: Sequence[int], torque: float) -> None:
        _, r = self._pose()
        about_left = [torque * part for part in r[1::3]]
        for link in links:
            self._client.applyExternalTorque(self._id, link, torqueObj=about_left, flags=pybullet.WORLD_FRAME)

    def _ahead_of_axle(self) -> float:
        """Distance of the centre of mass ahead of the axle, along the ground [m]."""
        _, r = self._pose()
        lx, lz = self._arm
        level = hypot(r[0], r[3])
        return float(lx * level + lz * (r[2] * r[0] + r[5] * r[3]) / level)

    def _axle(self) -> list[float]:
        """Where the middle of the axle is [m], (3,)."""
        place, r = self._pose()
        lx, lz = self._arm
        return [p - lx * r[3 * i] - lz * r[3 * i + 2] for i, p in enumerate(place)]

    def _pose(self) -> tuple[Vector, tuple[float, ...]]:
        """Where the centre of mass is, and the rotation from body to world row by row, (9,)."""
        place, orientation = self._client.getBasePositionAndOrientation(self._id)
        return place, pybullet.getMatrixFromQuaternion(orientation)


def _dot(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
