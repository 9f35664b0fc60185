"""A policy of each kind that twbal has, and what a header needs beside it."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from twbal.core.channels import Channels
from twbal.core.feed_forward import FeedForward
from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.embedded.compiler import CompiledPolicy, c_compiler
from twbal.embedded.header import Exported, header
from twbal.embedded.working_range import half_widths
from twbal.policies.linear import LinearPolicy
from twbal.policies.mlp import MlpPolicy
from twbal.policies.rbf import RbfPolicy
from twbal.policies.saved import SavedPolicy, load_policy

ROOT = Path(__file__).resolve().parents[2]
PLACE = ("tilt", "tilt_rate", "speed", "command_1", "command_2", "position", "position_integral")
PAPER = ("tilt", "tilt_rate", "acceleration")
TILT_LIMIT = 0.5236
COMPILER = c_compiler()


def _network(channels: tuple[str, ...], compensation: float, basis: int = 12, seed: int = 0) -> RbfPolicy:
    rng = np.random.default_rng(seed)
    scale = np.array([0.15, 0.8, 0.5, 8.0, 8.0, 0.3, 0.3])[: len(channels)]
    return RbfPolicy(
        channels=channels,
        centres=scale * rng.normal(size=(basis, len(channels))),
        weights=0.3 * rng.normal(size=basis) * (np.arange(basis) != 3),  # one has no weight
        lengths=1.5 * scale,
        gain=rng.normal(size=len(channels)) / scale / 3,
        max_command=20.0,
        compensation=compensation,
        bias=0.07,
    )


def _layers(widths: tuple[int, ...], activation: str, squash: str) -> MlpPolicy:
    rng = np.random.default_rng(5)
    weights = tuple(rng.normal(size=(b, a)) / np.sqrt(a) for a, b in pairwise(widths))
    return MlpPolicy(PLACE, weights, tuple(rng.normal(size=b) for b in widths[1:]), activation, squash, 20.0)


POLICIES: dict[str, SavedPolicy] = {
    "searched": load_policy(ROOT / "data" / "regression" / "policy.pt"),
    "place": _network(PLACE, 0.0),
    "friction": _network(PLACE, 0.25),
    "paper": _network(PAPER, 0.0, basis=50),
    "regulator_with_friction": _network(PLACE, 0.4, basis=0),
    "linear": LinearPolicy(PLACE, np.array([90.0, 11.0, 14.0, 0.1, 0.05, 9.0, 2.0]), 0.4, 20.0),
    "tanh": _layers((7, 64, 32, 1), "tanh", "tanh"),
    "relu": _layers((7, 16, 1), "relu", "clip"),
}


def exported(policy: SavedPolicy, robot: RobotParameters) -> Exported:
    """What is written as a header."""
    channels = Channels(policy.channels, robot.wheel_radius, robot.control_period)
    made_by = "Made by a test."
    return Exported(policy, channels, robot.control_period, robot.name, made_by, FeedForward.of_robot(robot))


def widths_of(policy: SavedPolicy, robot: RobotParameters) -> Array:
    """Half widths of its working range (D,)."""
    channels = exported(policy, robot).channels
    return half_widths(channels.names, channels.max_position_integral, robot, TILT_LIMIT)


def compiled(policy: SavedPolicy, robot: RobotParameters) -> CompiledPolicy:
    """Its header, compiled here."""
    assert COMPILER is not None
    return CompiledPolicy(header(exported(policy, robot)), COMPILER)
