"""Motors, gears and dry friction that a physics engine has no form for, beside it step by step."""

from dataclasses import replace
from math import pi

from twbal.core.engine import RobotMotion
from twbal.core.mobility import geared_mobilities, joint_mobility
from twbal.core.play import Play
from twbal.core.robot_model import UNBOUNDED, RobotModel
from twbal.core.robot_parameters import RobotParameters
from twbal.sim.loose_rotors import LooseRotors, geared_inertia, rolling_mobilities
from twbal.sim.presliding import Bristles


class Gears:
    """What stands between the motors and the wheels.

    With a backlash the rotors turn by themselves within the gap. At its ends they meet the wheels. On rigid gears that
    is a plastic impact: each step passes on the torque that brings the rotors, where they would pass an end, just to
    it. Gears that bend are a spring and a damper there, which push and never pull (`core.play`).

    Geared rotors of the inertia g turn at φ̇ - θ̇, so their energy is ½ g (φ̇² + θ̇²) - g φ̇ θ̇. For the first two terms
    the engine's wheels and its body have g as well. The last one makes the torques g θ̈ on the wheels and g φ̈ on the
    body. In the joints, -g (φ̈ - θ̈) would be all of it; but beside lighter wheels that slide such a torque grows from
    step to step.

    Rotors behind a backlash have as much of g as they can: the share s of their inertia J. They turn by
    J ρ̈ = τ - (contact) + s J θ̈, and do to the body what `planar.rolling` says. The rest of g is on the wheels' side and
    as above.

    Attributes:
        robot: what is left for the engine: wheels without the rotors, where these turn by themselves.
        geared: inertia of both rotors [kg·m²], by which the engine's body is harder to pitch.
        feels_accelerations: whether wheels and body that are accelerated turn rotors.
        needed: whether there is anything to do in a step.
        friction_changes: whether the joints' dry friction depends on their rate.
    """

    def __init__(self, model: RobotModel, physics_step: float) -> None:
        drive, robot = model.drive, model.robot
        gap, share, time, damping = drive.gap, drive.rotor_share, drive.contact_time, drive.contact_damping
        self._is_behind_encoder = drive.shaft_gap > 0
        if self._is_behind_encoder:
            gap, share = drive.shaft_gap, drive.shaft_rotor_share
            time, damping = drive.shaft_contact_time, drive.shaft_contact_damping
        loose = gap > 0
        whole = model.with_rotors
        self.robot: RobotParameters = (
            replace(whole, wheel_inertia=(1.0 - share) * whole.wheel_inertia) if loose else whole
        )
        rotors, pace = 2 * share * whole.wheel_inertia if loose else 0.0, pi / time if time > 0 else 0.0
        geared = geared_inertia(2 * (whole.wheel_inertia - robot.wheel_inertia), rotors)
        behind = float(self._is_behind_encoder)
        play = Play(rotors, gap, rotors * pace**2, 2 * damping * rotors * pace, behind)
        self._rotors = LooseRotors(play, geared, self.robot, model.ground, physics_step) if loose else None
        self.geared, self._carried, self._coupling = geared.turning, geared.carried, geared.coupling
        self.feels_accelerations = geared.turning > 0 or geared.carried > 0
        self._joint_gains = self._body_gains = 0.0, 0.0
        if self._coupling and model.ground.grip == UNBOUNDED:
            self._joint_gains, self._body_gains = self._rolling_gains()
        self.friction_changes = drive.breakaway > 0
        self._drive = drive
        angle = drive.presliding if drive.dry_friction(0.0) else 0.0
        self._bristles = Bristles(robot, angle, joint_mobility(self.robot), physics_step) if angle else None
        self.needed = loose or self.friction_changes or self.feels_accelerations or self._bristles is not None
        self._physics_step = physics_step
        self.reset()

    def _rolling_gains(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Rates that wheels and body gain by impulses between them, and by ones on the body alone [1/(kg·m²)]."""
        free = rolling_mobilities(self.robot, self.geared, self._coupling)
        on_body = free.both, free.body
        if self._rotors is None:
            return geared_mobilities(self.robot, self._coupling), on_body
        return (free.wheels - free.both, free.both - free.body), on_body

    def reset(
        self,
        ahead: float = 0.0,
        faster: float = 0.0,
        friction: tuple[float, float] = (0.0, 0.0),
        accelerations: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Begin a rollout.

        Args:
            ahead: of the wheels are the rotors, within the gap [rad].
            faster: than the wheels are they [rad/s].
            friction: in the left joint and the right one, where dry friction grows over an angle [N·m].
            accelerations: of wheels and body without torque, for the first step of geared rotors [rad/s²].
        """
        self._accelerations = accelerations
        self._before: tuple[float, float, float, float] | None = None  # rates and torques, as of `turn_rotors`
        if self._bristles:
            self._bristles.begin(friction)
        if self._rotors:
            self._rotors.begin(ahead, faster, accelerations)

    def seen(self, motion: RobotMotion) -> RobotMotion:
        """The motion as encoders see it, which may sit on the rotors' side of a backlash."""
        if not self._is_behind_encoder or self._rotors is None:
            return motion
        angle, rate = self._rotors.motion(motion)
        return motion._replace(wheel_angle=angle, wheel_rate=rate)

    def rub(self, motion: RobotMotion) -> tuple[float, float]:
        """Dry friction in the left joint and the right one in the next step [N·m], where it grows over an angle."""
        if self._bristles is None:
            return 0.0, 0.0
        rate, apart, friction = motion.wheel_rate, self._bristles.apart(motion.yaw_rate), self._drive.dry_friction
        bounds = friction(rate - apart), friction(rate + apart)
        return self._bristles.rub(rate, motion.yaw_rate, bounds, friction(0.0))

    def beside_joints(self, torque: float, passed: float) -> float:
        """Torque on the body beside those of the joints [N·m], for one physics step.

        The motors push themselves off the body, whatever their rotors meet. Geared rotors push back as they speed up.

        Args:
            torque: of the motors.
            passed: what `pass_on` has made of it.
        """
        return (1.0 - self._carried) * (passed - torque)

    def turn_rotors(self, torque: float, beside: float, motion: RobotMotion) -> tuple[float, float]:
        """Torques on the wheels and on the body by which geared rotors couple them, for one physics step [N·m].

        By the accelerations in the step before, and on wheels that roll by how much the torques have changed since.
        What these torques change of them comes back smaller.

        Args:
            torque: in the joints, between body and wheels.
            beside: on the body alone.
            motion: at the step's start.
        """
        if not self._coupling:
            return 0.0, 0.0
        now = motion.wheel_rate + motion.tilt_rate, motion.tilt_rate
        changed, more = torque, beside
        if self._before is not None:
            changed, more = torque - self._before[2], beside - self._before[3]
            wheel, body = (new - old for new, old in zip(now, self._before[:2], strict=True))
            self._accelerations = wheel / self._physics_step, body / self._physics_step
        self._before = (*now, torque, beside)
        gains = zip(self._accelerations, self._joint_gains, self._body_gains, strict=True)
        wheel, body = (a + changed * by + more * by_body for a, by, by_body in gains)
        return self._coupling * body, self._coupling * wheel

    def pass_on(self, torque: float, motion: RobotMotion) -> float:
        """Torque on the wheels of what the motors make [N·m], for one physics step."""
        return self._rotors.pass_on(torque, motion) if self._rotors else torque
