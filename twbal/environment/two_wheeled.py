"""A robot behind the interface `Plant`, as an environment of Gymnasium."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twbal.core.channels import Channels, StateTracker
from twbal.core.cost import Cost
from twbal.core.errors import ConfigError, DataError, install_advice
from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Array
from twbal.core.palette import REAL
from twbal.core.plant import Observation, Plant
from twbal.core.robot_parameters import RobotParameters
from twbal.sim.film import Image, Role, film

try:
    import gymnasium
    from gymnasium.spaces import Box
except ImportError as error:
    raise ConfigError(f"An environment of Gymnasium needs gymnasium: {install_advice('rl')}.") from error

Action = NDArray[np.float32]
_TRIALS = 2**31  # that a seed draws from


class TwoWheeled(gymnasium.Env[Array, Action]):
    """A robot that is to stay up.

    The observation is the state (D,), float64, in the channels' units. The action (1,) is the command as a share of the
    torque limit, in [-1, 1]. The reward is 1 - c(x) of the state that the action led to, in [0, 1]. An episode is
    terminated where the measured tilt passes `rule.tilt_limit`, and truncated after `rule.steps` control periods.

    `reset(seed=...)` decides all that follows. An episode is a trial of the plant, whose number `info["trial"]` says;
    `reset(options={"trial": 3})` chooses it.

    Args:
        plant: the robot; closed with the environment.
        robot: its data sheet.
        channels: the state.
        cost: of a state.
        rule: when an episode ends.
        render_mode: "rgb_array", or None.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}  # noqa: RUF012 (so Gymnasium declares it)

    def __init__(
        self,
        plant: Plant,
        robot: RobotParameters,
        channels: Channels,
        cost: Cost,
        rule: SuccessCriterion,
        render_mode: str | None = None,
    ) -> None:
        self.metadata = {**self.metadata, "render_fps": round(1.0 / plant.control_period)}
        self.render_mode = render_mode
        self.channels = channels
        self.torque_limit = robot.torque_limit
        past = [name in channels.lags for name in channels.names]
        bound = np.where(past, robot.torque_limit, np.inf)
        self.observation_space = Box(-bound, bound, dtype=np.float64)
        self.action_space = Box(-1.0, 1.0, (1,), np.float32)
        self._plant, self._robot, self._cost, self._rule = plant, robot, cost, rule
        self._seen = Observation(*[0.0] * len(Observation._fields))
        self._tracker = StateTracker(channels)
        self._commands: list[float] = []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: of this and all later episodes; None goes on.
            options: {"trial": number} chooses the trial of the plant.
        """
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(_TRIALS))
        trial = int((options or {}).get("trial", drawn))
        self._commands = []
        self._tracker = StateTracker(self.channels)
        self._seen = self._plant.reset(trial)
        return self._state(), {"trial": trial}

    def step(self, action: Action) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold a command for one control period.

        Raises:
            DataError: the action is not one finite number.
        """
        if np.shape(action) != (1,) or not np.isfinite(action[0]):
            raise DataError(f"An action must be one finite number, as a share of the torque limit; found {action}.")
        command = self.torque_limit * float(np.clip(action[0], -1.0, 1.0))
        self._seen = self._plant.step(command)
        self._commands.append(command)
        state = self._state()
        fallen = abs(self._seen.tilt) > self._rule.tilt_limit
        return state, 1.0 - float(self._cost(state)), fallen, len(self._commands) >= self._rule.steps, {}

    def render(self) -> Image | None:
        """The robot as it stands, (270, 480, 3); None where no `render_mode` was given."""
        if self.render_mode is None:
            return None
        wheel_over_ground = self._seen.wheel_angle + self._seen.tilt
        pose = [self._robot.wheel_radius * wheel_over_ground, self._seen.tilt, self._seen.wheel_angle]
        (frame,) = film(self._robot, [Role(np.array([pose]), REAL.parts)], 480, 270)
        return frame

    def close(self) -> None:
        """Let go of the robot."""
        self._plant.close()

    def _state(self) -> Array:
        return self._tracker.state(self._seen, self._commands)
