"""Firmware that adds a torque in the direction in which the wheels turn."""

from dataclasses import dataclass
from math import tanh

from twbal.core.robot_model import JointMotion
from twbal.effects.effect import JointTorqueEffect
from twbal.effects.parameter import Scale, parameter


@dataclass(frozen=True)
class FrictionFeedforward(JointTorqueEffect):
    """Firmware that adds torque·tanh(ω / rate) to each motor, ω being the wheel's rate relative to the body.

    Motor controllers do that to make up for Coulomb friction once a wheel turns. Where the log has the command before
    it is added, the joints seem to have less friction than none. Another way, by the direction of the command, is
    friction_compensation. Where the joints rub as well, little more than the difference of the two is well known. It
    acts between wheel and body, so that neither a dead zone nor a limit of the driver takes anything from it.
    """

    torque: float = parameter(
        "that is added to each wheel",
        "N·m",
        (0.0, 2.0),
        start=0.1,
        value=0.3,
        scale=Scale.TORQUE,
        is_of_each_wheel=True,
    )
    rate: float = parameter(
        "wheel's rate at which three quarters of it are there",
        "rad/s",
        (0.05, 3.0),
        start=0.3,
        value=0.5,
        neutral=0.3,
        least=1e-3,
    )
    reference = (
        "H. Olsson, K. J. Åström, C. Canudas de Wit, M. Gäfvert, P. Lischinsky: Friction models and friction "
        "compensation, European Journal of Control 4, 1998."
    )
    is_linear = False
    nearly_same_as = ("friction_compensation",)
    separate_by = "Turn the wheels by hand, switched on and with no command: they go on by themselves, or turn easily."

    def turn(self, torque: float, at: JointMotion) -> float:
        """Add what the firmware adds."""
        if self.torque == 0.0:
            return torque
        faster, slower = (at.rate + at.apart_rate) / self.rate, (at.rate - at.apart_rate) / self.rate
        return torque + self.torque * (tanh(faster) + tanh(slower))
