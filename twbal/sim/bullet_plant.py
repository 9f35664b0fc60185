"""The robot in PyBullet, behind the interface `Plant`."""

from collections.abc import Sequence

from twbal.core.engine import EnginePlant, dividing_step
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import StartPose
from twbal.effects.effect import Effect, assemble
from twbal.sim.world import World


class SimPlant(EnginePlant):
    """A robot with effects, integrated by PyBullet.

    Args:
        robot: the data sheet.
        effects: what the data sheet leaves out; each acts at its place, whatever its place in the list.
        start: where rollouts begin.
        physics_step: of the integrator [s], at most 1 ms; the one that is used is the longest that is no longer
            and divides the control period.
        seed: of all randomness.

    Raises:
        ConfigError: the physics step is not positive, or too long.
    """

    def __init__(
        self, *, robot: RobotParameters, effects: Sequence[Effect], start: StartPose, physics_step: float, seed: int
    ) -> None:
        model = assemble(robot, effects)
        step = dividing_step(robot.control_period, physics_step)
        super().__init__(model, World(model, step), start, step, seed)
