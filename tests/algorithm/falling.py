"""Rollouts of a robot that falls."""

import numpy as np

from twbal.core.episode import Episode, Outcome, Provenance

PLACED = ("tilt", "tilt_rate", "speed", "command_1", "command_2", "position", "position_integral")


def falls_at_once(robot, steps):
    """A rollout that ended after so few steps."""
    seen = np.zeros((steps + 1, 7))
    seen[:, 0] = robot.control_period * np.arange(steps + 1)
    seen[:, 1] = np.linspace(-0.25, -0.29, steps + 1)
    states, commands = np.zeros((steps + 1, len(PLACED))), np.full(steps, 3.0)
    told = Provenance("paper", "robot")
    return Episode(PLACED, robot.control_period, seen, states, commands, Outcome.TILT_LIMIT, told)
