"""Which simulated robot: what a plant is made from, in one value."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from twbal.core.engine import dividing_step
from twbal.core.errors import ConfigError
from twbal.core.plant import Plant
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import StartPose
from twbal.effects.effect import Effect
from twbal.effects.library import effects_from
from twbal.planar.planar_plant import PlanarPlant
from twbal.sim.bullet_plant import SimPlant
from twbal.sim.randomised import Draws, RandomisedPlant


class EngineName(StrEnum):
    """What integrates the motion."""

    PYBULLET = "pybullet"
    PLANAR = "planar"
    """The analytical equations of motion of a robot that drives straight ahead."""


@dataclass(frozen=True)
class Simulation:
    """A simulated robot.

    Attributes:
        robot: nominal parameters.
        start: where rollouts begin.
        physics_step: upper bound of that of the integrator [s]; see `used_step`.
        effects: what the nominal parameters leave out.
        engine: that integrates the motion.
        draws: ranges of further effects, whose size PyBullet draws anew for each rollout; none: {}.
    """

    robot: RobotParameters
    start: StartPose
    physics_step: float
    effects: tuple[Effect, ...] = ()
    engine: EngineName = EngineName.PYBULLET
    draws: Draws = field(default_factory=dict)

    def plant(self, seed: int) -> Plant:
        """The robot, at rest; all randomness comes from `seed`.

        Raises:
            ConfigError: the physics step is not positive, or robots of the planar model are to be drawn.
        """
        robot, start, step = self.robot, self.start, self.physics_step
        if self.engine is EngineName.PLANAR:
            if self.draws:
                raise ConfigError(
                    f"The planar model draws no robots; found {', '.join(self.draws)} in sim.draws. Leave sim.engine "
                    "out, or choose another sim."
                )
            return PlanarPlant(robot=robot, effects=self.effects, start=start, physics_step=step, seed=seed)
        if self.draws:
            return RandomisedPlant(
                robot=robot, effects=self.effects, draws=self.draws, start=start, physics_step=step, seed=seed
            )
        return SimPlant(robot=robot, effects=self.effects, start=start, physics_step=step, seed=seed)

    @property
    def used_step(self) -> float:
        """The physics step that is used [s]."""
        return dividing_step(self.robot.control_period, self.physics_step)

    def having(self, effects: Iterable[Effect]) -> "Simulation":
        """The same robot with these effects besides; one of a kind that it has takes the other's place."""
        effects = tuple(effects)
        kinds = {type(effect) for effect in effects}
        return replace(self, effects=(*(own for own in self.effects if type(own) not in kinds), *effects))

    def with_values(self, values: Mapping[str, Mapping[str, float]], physics_step: float) -> "Simulation":
        """The same robot with other effects, by name and parameter, in PyBullet."""
        effects = tuple(effects_from(values))
        return replace(self, effects=effects, physics_step=physics_step, engine=EngineName.PYBULLET, draws={})
