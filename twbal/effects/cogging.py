"""Motors that pull towards their poles."""

from dataclasses import dataclass
from math import cos, sin

from twbal.core.robot_model import JointMotion, JointTorque
from twbal.core.robot_parameters import RobotParameters
from twbal.effects.effect import JointEffect, parameter


@dataclass(frozen=True)
class Cogging(JointEffect):
    """Each joint feels torque·sin(count·angle + phase), angle being that of the wheel relative to the body.

    It acts between wheel and body.

    Attributes:
        torque: amplitude of each wheel [N·m].
        count: periods in a turn of the wheel.
        phase: [rad].
    """

    torque: float = parameter("N·m", 0.0, 2.0, 0.2, scale="torque")
    count: float = parameter("", 1.0, 60.0, 12.0)
    phase: float = parameter("rad", -3.2, 3.2, 0.0)
    cannot_be_told_from = ("ground_waves", "periodic_disturbance")
    separate_by = "Drive at several speeds."

    def __post_init__(self) -> None:
        self._require("torque", 0)
        self._require("count", 0)
        self._require("phase", -100, 100)

    def start(self, robot: RobotParameters, physics_step: float) -> JointTorque:
        """Hand out the joint; it remembers nothing."""
        return lambda torque, motion: torque + self._pull(motion)

    def _pull(self, motion: JointMotion) -> float:
        in_step = cos(self.count * motion.apart)  # the wheels of a robot that turns do not meet their poles together
        return 2.0 * self.torque * in_step * sin(self.count * motion.angle + self.phase)
