"""The training of an agent in an environment, and the policy that comes of it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from twbal.core.errors import ConfigError, install_advice
from twbal.core.gaussian import Array
from twbal.environment.agent import AgentRecipe
from twbal.environment.two_wheeled import Action, TwoWheeled
from twbal.policies.mlp import MlpPolicy

try:
    import gymnasium
    import stable_baselines3
    from gymnasium.spaces import Box
    from gymnasium.wrappers import TransformObservation
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.logger import Logger
except ImportError as error:
    raise ConfigError(f"Training an agent needs Stable-Baselines3: {install_advice('rl')}.") from error

Progress = Callable[[int, float | None], None]
"""Called with the steps so far, and of the mean return of the last episodes (None before the first has ended)."""

_ACTIVATIONS = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU}


def train(env: TwoWheeled, recipe: AgentRecipe, steps: int, seed: int, progress: Progress) -> BaseAlgorithm:
    """An agent that has driven `env` for `steps` control periods, or as many more as fill its last update.

    On one thread of the processor: the same seed gives the same agent on the same machine.

    Raises:
        ConfigError: the algorithm does not take its options, or a channel has no scale.
    """
    torch.set_num_threads(1)  # these networks are small: more threads wait for each other
    agent = _agent(_scaled(env, recipe), recipe, seed)

    def report(local: dict[str, Any], _: dict[str, Any]) -> bool:
        returns = [episode["r"] for episode in agent.ep_info_buffer or ()]
        progress(agent.num_timesteps, float(np.mean(returns)) if returns else None)
        return True

    agent.learn(steps, callback=report)
    return agent


def policy_of(agent: BaseAlgorithm, env: TwoWheeled, recipe: AgentRecipe) -> MlpPolicy:
    """What `agent` does without exploring, as a policy that takes the state in its own units."""
    network: Any = agent.policy
    if recipe.algorithm == "SAC":
        modules, squash = [*network.actor.latent_pi, network.actor.mu], "tanh"
    else:
        modules, squash = [*network.mlp_extractor.policy_net, network.action_net], "clip"
    linear = [module for module in modules if isinstance(module, torch.nn.Linear)]
    weights, biases = ([_plain(getattr(layer, part)) for layer in linear] for part in ("weight", "bias"))
    weights[0] = weights[0] / recipe.state_scales(env.channels, env.torque_limit)
    return MlpPolicy(
        env.channels.names, tuple(weights), tuple(biases), recipe.activation, squash, float(env.torque_limit)
    )


def _scaled(env: TwoWheeled, recipe: AgentRecipe) -> gymnasium.Env[NDArray[np.float32], Action]:
    """`env` as networks like to see it: every channel of the size of 1."""
    scales = recipe.state_scales(env.channels, env.torque_limit)
    space = Box(-np.inf, np.inf, scales.shape, np.float32)
    scaled: gymnasium.Env[NDArray[np.float32], Action] = TransformObservation(
        env, lambda state: (state / scales).astype(np.float32), space
    )
    return scaled


def _agent(env: gymnasium.Env[NDArray[np.float32], Action], recipe: AgentRecipe, seed: int) -> BaseAlgorithm:
    kind = getattr(stable_baselines3, recipe.algorithm)
    networks = {"net_arch": list(recipe.hidden), "activation_fn": _ACTIVATIONS[recipe.activation]}
    try:
        agent: BaseAlgorithm = kind(
            "MlpPolicy", env, policy_kwargs=networks, seed=seed, device="cpu", **dict(recipe.options)
        )
    except (TypeError, ValueError, AssertionError) as error:
        raise ConfigError(f"{recipe.algorithm} of Stable-Baselines3 does not take agent.options: {error}") from error
    if not agent.verbose and agent.tensorboard_log is None:  # Stable-Baselines3 would make a temporary folder
        agent.set_logger(Logger(None, []))
    return agent


def _plain(tensor: torch.Tensor) -> Array:
    return tensor.detach().numpy().astype(np.float64)
