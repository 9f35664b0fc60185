"""Ground and outside forces that a physics engine has no form for, beside it step by step."""

from math import cos, sin
from typing import NamedTuple

from twbal.core.engine import RobotMotion
from twbal.core.mobility import wheel_mobility
from twbal.core.plant import Pose
from twbal.core.robot_model import UNBOUNDED, AxleMotion, RobotModel
from twbal.core.robot_parameters import GRAVITY, RobotParameters
from twbal.sim.creeping_tyres import CreepingTyres
from twbal.sim.presliding import Bristles, cut, rates_apart
from twbal.sim.restart_state import RestartState

_SHARE = 1.0  # of the wheels' leftover rate that the holding torque learns from in a step


class Outside(NamedTuple):
    """What acts on the robot from outside in one physics step.

    Attributes:
        on_wheels: torque on both wheels, from the ground [N·m].
        at_axle: force, forward [N].
    """

    on_wheels: float
    at_axle: float


class OutsideForces:
    """What acts from outside.

    Dry rolling resistance is a torque within bounds that would stop the wheels in this step, beside one that it has
    learned to hold them with: as the motor of an engine does it, but one step behind. Where the robot turns, it would
    stop the slower wheel; on wheels that roll opposite ways it cancels. Or it grows over an angle.

    Args:
        model: the robot with its effects.
        robot: as the engine has it, whose wheels are without rotors behind a backlash: how far a force changes a rate
            in one step follows from their inertia.
        physics_step: [s].

    Attributes:
        needed: whether there is anything to do in a step.
        pushes: forces at the axle.
        creeps: whether tyres creep, so that their traction is one of these forces.
    """

    def __init__(self, model: RobotModel, robot: RobotParameters, physics_step: float) -> None:
        ground = model.ground
        self._bound = 2 * ground.rolling_resistance
        self._viscous = 2 * ground.rolling_viscous
        self.pushes = model.pushes
        self._weight = (robot.body_mass + 2 * robot.wheel_mass) * GRAVITY
        self._physics_step = physics_step
        self._stopping = 1 / (physics_step * wheel_mobility(robot))  # torque that stops a rate in one step
        angle = model.drive.presliding if self._bound else 0.0
        self._bristles = Bristles(robot, angle, wheel_mobility(robot), physics_step) if angle else None
        self.creeps = ground.grip < UNBOUNDED and ground.tyre_creep > 0.0
        self._tyres = CreepingTyres(robot, ground, physics_step)
        self._radius, self._apart = robot.wheel_radius, rates_apart(robot)
        self.needed = self.creeps or bool(self._bound or self._viscous or self.pushes)
        self.reset()

    def reset(self, begun: RestartState | None = None, time: float = 0.0) -> None:
        """Begin a rollout, or go on with one that has lasted for so long [s]."""
        self._begun = begun or RestartState(0.0)
        self._ahead = cos(self._begun.heading), sin(self._begun.heading)
        self._position, self._time, self._held = self._begun.position, time, 0.0
        self._tyres.begin()
        if self._bristles:
            self._bristles.begin(self._begun.ground)

    def act(self, motion: RobotMotion, pose: Pose, apart: float, load: float) -> Outside:
        """What acts in the step that begins with a motion.

        Args:
            motion: of the robot.
            pose: from where it was put since `reset`; needed where there are `pushes`.
            apart: by which one wheel is ahead of the mean [rad].
            load: weight on the wheels [N]; needed where they creep.
        """
        rate = motion.wheel_rate + motion.tilt_rate
        torque = -self._viscous * rate
        if self._bristles:
            of_each = 0.5 * self._bound
            torque += sum(self._bristles.rub(rate, motion.yaw_rate, (of_each, of_each), of_each))
        elif self._bound:
            apart = self._apart * abs(motion.yaw_rate)
            stop = (rate - cut(rate - self._held / self._stopping, apart)) * self._stopping
            self._held = cut(self._held - _SHARE * stop, self._bound)
            torque += cut(self._held - stop, self._bound)
        angle, force = motion.wheel_angle + motion.tilt, 0.0
        cosine, sine = self._ahead
        axle = AxleMotion(
            self._position,
            motion.speed,
            self._time,
            self._weight,
            angle,
            rate,
            apart,
            x=self._begun.x + cosine * pose.x - sine * pose.y,
            y=self._begun.y + sine * pose.x + cosine * pose.y,
            cosine=cos(self._begun.heading + pose.heading),
            sine=sin(self._begun.heading + pose.heading),
        )
        for push in self.pushes:
            force = push(force, axle)
        if self.creeps:
            traction = self._tyres.pull(motion.speed - self._radius * rate, load)
            torque -= self._radius * traction
            force += traction
        self._position += self._physics_step * motion.speed
        self._time += self._physics_step
        return Outside(torque, force)
