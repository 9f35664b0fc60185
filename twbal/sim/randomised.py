"""A simulated robot that is another one in each rollout: domain randomisation."""

from collections.abc import Mapping, Sequence

from twbal.core.errors import ConfigError
from twbal.core.plant import Observation, Plant, Pose
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import StartPose
from twbal.core.streams import Stream, generator
from twbal.effects.effect import Effect
from twbal.effects.library import all_effects
from twbal.effects.parameter import parameters_of
from twbal.sim.bullet_plant import SimPlant

Draws = Mapping[str, Mapping[str, Sequence[float]]]
"""Ranges [lowest, highest] by effect and by parameter."""


class RandomisedPlant(Plant):
    """PyBullet with effects of random size, drawn anew from (seed, trial) for each rollout, evenly over ranges.

    Args:
        robot: data sheet.
        effects: that every robot has.
        draws: what is drawn.
        start: where rollouts begin.
        physics_step: [s]; as of `SimPlant`.
        seed: of all randomness.

    Raises:
        ConfigError: there is no such effect or parameter, or a range is not a pair in order.
    """

    def __init__(
        self,
        *,
        robot: RobotParameters,
        effects: Sequence[Effect],
        draws: Draws,
        start: StartPose,
        physics_step: float,
        seed: int,
    ) -> None:
        self.control_period, self.command_limit = robot.control_period, robot.torque_limit
        self._robot, self._effects, self._draws = robot, list(effects), draws
        self._start, self._physics_step, self._seed = start, physics_step, seed
        for name, ranges in draws.items():
            if name not in all_effects():
                raise ConfigError(f"There is no effect {name!r} to draw; the effects are: {', '.join(all_effects())}.")
            known = parameters_of(all_effects()[name])
            for parameter, pair in ranges.items():
                if parameter not in known:
                    raise ConfigError(f"{name} has no parameter {parameter!r}; it has: {', '.join(known)}.")
                if len(pair) != 2 or not pair[0] <= pair[1]:
                    raise ConfigError(f"The range of {name}.{parameter} must be [lowest, highest]; found {list(pair)}.")
        self._plant: SimPlant | None = None

    def drawn(self, trial: int) -> list[Effect]:
        """What the robot of a trial has beside those effects that all have, or in the place of one of a kind."""
        rng = generator(Stream.DOMAIN_RANDOMISATION, self._seed, trial)
        return [
            all_effects()[name](**{key: float(rng.uniform(pair[0], pair[1])) for key, pair in ranges.items()})
            for name, ranges in self._draws.items()
        ]

    def reset(self, trial: int) -> Observation:
        """Begin the rollout that (seed, trial) names, with another robot."""
        self.close()
        drawn = self.drawn(trial)
        kinds = {type(effect) for effect in drawn}
        self._plant = SimPlant(
            robot=self._robot,
            effects=[*(own for own in self._effects if type(own) not in kinds), *drawn],
            start=self._start,
            physics_step=self._physics_step,
            seed=self._seed,
        )
        return self._plant.reset(trial)

    def step(self, command: float) -> Observation:
        """Hold the command for one control period."""
        if self._plant is None:
            raise ConfigError("A plant must be reset before its first step.")
        return self._plant.step(command)

    def pose(self) -> Pose | None:
        """The true pose at the last observation."""
        return None if self._plant is None else self._plant.pose()

    def stop(self) -> None:
        """Nothing moves between rollouts."""

    def close(self) -> None:
        """Let go of the engine."""
        if self._plant is not None:
            self._plant.close()
        self._plant = None
