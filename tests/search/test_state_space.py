"""The linear model in the channels of the state, beside the robot that it is a model of."""

import numpy as np
import pytest

from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.core.plant import Observation
from twbal.core.start_pose import StartPose
from twbal.effects.library import effects_from
from twbal.planar import linearised
from twbal.planar.linearised import sampled_with_delay
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant
from twbal.search.linear_starts import state_space

NAMES = ("position_integral", "command_2", "tilt", "speed", "position", "command_1", "tilt_rate")
STEPS = 25


@pytest.mark.parametrize("late", [0.0, 0.6, 1.4])
@pytest.mark.parametrize("angle", [0.0, 0.06])
def test_it_follows_small_motions_of_the_robot_in_every_channel(paper, monkeypatch, late, angle):
    T, physics_steps = paper.control_period, 50
    monkeypatch.setattr(linearised, "_STEPS", physics_steps)
    effects = {
        "actuation_delay": {"delay": late * T},
        "com_offset": {"angle": angle},
        "viscous_friction": {"coefficient": 0.05},
        "torque_gain": {"gain": 0.8},
    }
    channels = Channels(NAMES, paper.wheel_radius, T)
    linear = sampled_with_delay(planar_parameters(paper, effects), T, 2)
    A, B = state_space(linear, channels)
    start = StartPose(linear.balance + 1e-4, 0.0, 0.0, 0.0)
    plant = PlanarPlant(robot=paper, effects=effects_from(effects), start=start, physics_step=T / physics_steps, seed=0)
    seen = [plant.reset(0)]
    commands = 0.02 * np.random.default_rng(0).standard_normal(STEPS)
    seen += [plant.step(float(command)) for command in commands]
    truth = channels.states(np.array([Observation(*row) for row in seen]), commands)
    truth[:, NAMES.index("tilt")] -= linear.balance
    x = truth[0]
    found = [x]
    for command in commands:
        x = A @ x + B * command
        found.append(x)
    largest = np.abs(truth).max(axis=0)
    assert (largest > 0).all()
    gaps = np.abs(np.array(found) - truth).max(axis=0) / largest
    for name, gap in zip(NAMES, gaps, strict=True):
        # the trapezoid rule knows the speed at either end of a period only
        assert gap < (0.01 if name.startswith("position") else 1e-3), (name, gap)


def test_what_the_robot_does_in_a_straight_line_leaves_other_channels_alone(paper):
    channels = Channels(("tilt", "yaw_rate", "tilt_rate", "acceleration", "speed"), paper.wheel_radius)
    A, B = state_space(sampled_with_delay(planar_parameters(paper, {}), paper.control_period, 0), channels)
    for k in (1, 3):
        np.testing.assert_array_equal(A[k], np.eye(5)[k])
        assert B[k] == 0.0


def test_a_state_without_speed_is_refused(paper):
    linear = sampled_with_delay(planar_parameters(paper, {}), paper.control_period, 0)
    with pytest.raises(ConfigError, match="has no speed"):
        state_space(linear, Channels(("tilt", "tilt_rate"), paper.wheel_radius))
