"""A centre of mass higher or lower than the data sheet's."""

from dataclasses import dataclass, replace

from twbal.robot.parameters import RobotParameters
from twbal.sim.effects.effect import BodyEffect


@dataclass(frozen=True)
class ComHeight(BodyEffect):
    """The centre of mass is `factor` times as far from the axle; the inertia about it stays.

    It acts on the body. It can hardly be told from the wheels' radius.

    Attributes:
        factor: true height over the data sheet's.
    """

    factor: float

    def __post_init__(self) -> None:
        self._require("factor", 1e-3)

    def alter(self, robot: RobotParameters) -> RobotParameters:
        """Scale the height."""
        return replace(robot, com_height=self.factor * robot.com_height)
