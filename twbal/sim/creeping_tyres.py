"""Tyres that creep before they slide, which a physics engine has no form for."""

from twbal.core.mobility import slip_mobility
from twbal.core.robot_model import Ground
from twbal.core.robot_parameters import GRAVITY, RobotParameters
from twbal.core.tyres import traction_impulse


class CreepingTyres:
    """The traction of both wheels, step by step.

    What else changes the slip is taken to be as in the step before.
    """

    def __init__(self, robot: RobotParameters, ground: Ground, physics_step: float) -> None:
        self._grip, self._creep, self._step = ground.grip, ground.tyre_creep, physics_step
        self._mobility = slip_mobility(robot)
        self._weight = (robot.body_mass + 2.0 * robot.wheel_mass) * GRAVITY
        self.begin()

    def begin(self) -> None:
        """Begin a rollout."""
        self._slip_before: float | None = None
        self._impulse = 0.0

    def pull(self, slip: float, load: float) -> float:
        """Force of the ground on the tyres in the next physics step, forward [N].

        Args:
            slip: speed of the axle beyond that of wheels which roll [m/s].
            load: on the wheels in the last physics step [N]; in the first of a rollout, the robot's weight counts.
        """
        others = 0.0  # what else changed the slip in the last step
        if self._slip_before is None:
            load = self._weight
        else:
            others = slip - self._slip_before - self._mobility * self._impulse
        self._slip_before = slip
        self._impulse = traction_impulse(slip + others, self._mobility, self._step * self._grip * load, self._creep)
        return self._impulse / self._step
