"""Motors, gears and dry friction that a physics engine has no form for, beside it step by step."""

from dataclasses import replace
from math import pi

from twbal.core.engine import RobotMotion
from twbal.core.mobility import geared_mobilities, joint_mobility, wheel_mobility
from twbal.core.play import Play, engage
from twbal.core.robot_model import UNBOUNDED, RobotModel
from twbal.core.robot_parameters import RobotParameters
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

    Attributes:
        robot: what is left for the engine: wheels without the rotors, where these turn by themselves.
        geared: inertia of both rotors [kg·m²], by which the engine's body is harder to pitch.
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
        self.geared = 2 * (whole.wheel_inertia - robot.wheel_inertia)
        self._torque_gains = geared_mobilities(whole, self.geared) if model.ground.grip == UNBOUNDED else (0.0, 0.0)
        self.friction_changes = drive.breakaway > 0
        self._drive = drive
        angle = drive.presliding if drive.dry_friction(0.0) else 0.0
        self._bristles = Bristles(robot, angle, joint_mobility(self.robot), physics_step) if angle else None
        self.needed = loose or self.friction_changes or self.geared > 0 or self._bristles is not None
        rotors, pace = 2 * share * whole.wheel_inertia, pi / time if time > 0 else 0.0
        behind = float(self._is_behind_encoder)
        self._play = Play(rotors, gap, rotors * pace**2, 2 * damping * rotors * pace, behind)
        self._mobility = wheel_mobility(self.robot)
        self._physics_step = physics_step
        self.reset()

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
            accelerations: of wheels and body without torque, for the first step of `turn_rotors` [rad/s²].
        """
        self._accelerations = accelerations
        self._before: tuple[float, float, float] | None = None  # rates of wheels and body, and the motors' torque
        if self._bristles:
            self._bristles.begin(friction)
        self._ahead, self._faster = ahead, faster
        self._rotor = self._rate = self._wheel_rate = self._contact = 0.0
        self._begins = True

    def seen(self, motion: RobotMotion) -> RobotMotion:
        """The motion as encoders see it, which may sit on the rotors' side of a backlash."""
        if not self._is_behind_encoder:
            return motion
        if self._begins:
            angle, rate = motion.wheel_angle + self._ahead, motion.wheel_rate + self._faster
            return motion._replace(wheel_angle=angle, wheel_rate=rate)
        return motion._replace(wheel_angle=self._rotor - motion.tilt, wheel_rate=self._rate - motion.tilt_rate)

    def rub(self, motion: RobotMotion) -> tuple[float, float]:
        """Dry friction in the left joint and the right one in the next step [N·m], where it grows over an angle."""
        if self._bristles is None:
            return 0.0, 0.0
        rate, apart, friction = motion.wheel_rate, self._bristles.apart(motion.yaw_rate), self._drive.dry_friction
        bounds = friction(rate - apart), friction(rate + apart)
        return self._bristles.rub(rate, motion.yaw_rate, bounds, friction(0.0))

    def turn_rotors(self, torque: float, motion: RobotMotion) -> tuple[float, float]:
        """Torques on the wheels and on the body by which geared rotors couple them, for one physics step [N·m].

        By the accelerations in the step before, and on wheels that roll by how much the motors' torque has changed
        since. What these torques change of them comes back smaller.
        """
        if not self.geared:
            return 0.0, 0.0
        now = motion.wheel_rate + motion.tilt_rate, motion.tilt_rate
        changed = torque
        if self._before is not None:
            changed = torque - self._before[2]
            wheel, body = (new - old for new, old in zip(now, self._before[:2], strict=True))
            self._accelerations = wheel / self._physics_step, body / self._physics_step
        self._before = (*now, torque)
        wheel, body = (a + changed * by for a, by in zip(self._accelerations, self._torque_gains, strict=True))
        return self.geared * body, self.geared * wheel

    def pass_on(self, torque: float, motion: RobotMotion) -> float:
        """Torque that the wheels get of what the motors make [N·m], for one physics step.

        What moves the wheels beside the contact is taken to be as in the step before.
        """
        if self._play.gap <= 0:
            return torque
        h, rotors = self._physics_step, self._play.rotors
        wheel, wheel_rate = motion.wheel_angle + motion.tilt, motion.wheel_rate + motion.tilt_rate
        if self._begins:
            self._rotor, self._rate = wheel + self._ahead, wheel_rate + self._faster
            self._wheel_rate, self._begins = wheel_rate, False
        drift = wheel_rate - self._wheel_rate - h * self._mobility * self._contact
        rate, wheels = self._rate + h * torque / rotors, wheel_rate + drift
        begin = self._rotor - wheel, self._rate - wheel_rate
        impulse, ahead = engage(self._play, h, *begin, rate - wheels, self._mobility)
        self._rate = rate - impulse / rotors
        self._rotor = wheel + h * (wheels + self._mobility * impulse) + ahead
        self._wheel_rate, self._contact = wheel_rate, impulse / h
        return self._contact
