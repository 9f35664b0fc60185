"""Motors that pull towards their poles."""

from dataclasses import dataclass
from math import cos, sin

from twbal.core.robot_model import JointMotion
from twbal.effects.effect import JointTorqueEffect
from twbal.effects.parameter import Scale, parameter


@dataclass(frozen=True)
class Cogging(JointTorqueEffect):
    """Each joint feels torque·sin(count·angle + phase), angle being that of the wheel relative to the body.

    The phase of the right wheel is that plus half of `difference`, and that of the left wheel minus it. It acts between
    wheel and body. The wheels of a robot that turns do not meet their poles together. How far apart these come follows
    from the track between the places at which the tyres touch the ground, which is hardly known to some per cent.
    """

    torque: float = parameter(
        "amplitude of the torque of each wheel",
        "N·m",
        (0.0, 2.0),
        start=0.2,
        value=0.3,
        scale=Scale.TORQUE,
        is_of_each_wheel=True,
    )
    count: float = parameter("poles: periods in a turn of the wheel", "", (1.0, 60.0), start=12.0, value=12.0)
    phase: float = parameter(
        "phase at angle 0, mean of both wheels", "rad", (-6.3, 6.3), start=0.0, value=0.0, least=-100.0, below=100.0
    )
    difference: float = parameter(
        "by which the right wheel's phase is ahead of the left one's",
        "rad",
        (-6.3, 6.3),
        start=0.0,
        value=0.0,
        least=-100.0,
        below=100.0,
        covers_all=True,
        sd=1.8,
        is_optional=True,
    )
    turning: float = parameter(
        "share by which the wheels come further apart, when the robot turns, than track and radius say",
        "",
        (-0.3, 0.3),
        start=0.0,
        value=0.0,
        least=-0.9,
        below=1.0,
        sd=0.05,
        is_optional=True,
    )
    reference = (
        "T. M. Jahns, W. L. Soong: Pulsating torque minimization techniques for permanent magnet AC motor drives - "
        "a review, IEEE Transactions on Industrial Electronics 43 (2), 1996, 321-330."
    )
    is_linear = False
    nearly_same_as = ("ground_waves", "periodic_disturbance")
    separate_by = "Drive at several speeds."

    def turn(self, torque: float, at: JointMotion) -> float:
        """Add the pull of both motors' poles."""
        if self.torque == 0.0:
            return torque
        ahead = (1.0 + self.turning) * at.apart * at.heading
        in_step = cos(self.count * ahead + 0.5 * self.difference)
        return torque + 2.0 * self.torque * in_step * sin(self.count * at.angle + self.phase)
