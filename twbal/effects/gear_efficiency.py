"""Gears that lose a share of the torque."""

from dataclasses import dataclass
from math import tanh

from twbal.core.robot_model import JointMotion
from twbal.effects.effect import JointTorqueEffect
from twbal.effects.parameter import parameter


@dataclass(frozen=True)
class GearEfficiency(JointTorqueEffect):
    """Gears of an efficiency η = 1 - `loss` pass on η·τ of the motors' torque τ where it drives, τ/η where it brakes.

    So the friction grows with the load. Between the two it is τ·η^s, s = sign(τ)·tanh(ω / 0.2 rad/s), ω being the
    wheel's rate relative to the body: near rest, where nothing is transmitted, nothing is lost. It acts between wheel
    and body, and is the same forward and backward. Driving alone, it is a torque gain; at one size of the torque, it is
    dry friction.
    """

    loss: float = parameter("share of the torque that the gears lose", "", (0.0, 0.6), start=0.1, value=0.2, below=1.0)
    reference = (
        "A. Wang, S. Kim: Directional efficiency in geared transmissions: characterization of backdrivability towards "
        "improved proprioceptive control, IEEE International Conference on Robotics and Automation, 2015, 1055-1062."
    )
    is_linear = False
    weighed_if_asked = True
    nearly_same_as = ("coulomb_friction", "torque_gain")
    separate_by = "Hold the robot by the wheels with and without a load, and turn them both ways."

    def turn(self, torque: float, at: JointMotion) -> float:
        """Take off what is lost, or add what the load must bring."""
        if self.loss == 0.0:
            return torque
        along = tanh(at.rate / 0.2)
        passed: float = torque * (1.0 - self.loss) ** (along if torque > 0.0 else -along)
        return passed
