from dataclasses import replace

import numpy as np
import pytest

from twbal.core.channels import Channels
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import DataError
from twbal.models.dataset import residuals, transitions, unbroken
from twbal.models.gp import condition

CHANNELS = Channels(("tilt", "command_1", "tilt_rate"), 0.15)


def episode(steps, seed, names=CHANNELS.names, period=0.02):
    rng = np.random.default_rng(seed)
    observations = rng.standard_normal((steps + 1, 7))
    observations[:, 0] = period * np.arange(steps + 1)
    states = rng.standard_normal((steps + 1, len(names)))
    provenance = Provenance("paper", "simulation")
    return Episode(names, period, observations, states, rng.standard_normal(steps), Outcome.COMPLETED, provenance)


def test_input_plus_change_is_the_next_state_and_no_sample_is_lost():
    episodes = [episode(5, 0), episode(0, 1), episode(3, 2)]
    data = transitions(episodes, CHANNELS)
    assert data.inputs.shape == (8, 4)
    after = np.concatenate([e.states[1:] for e in episodes])
    np.testing.assert_allclose(data.inputs[:, [0, 2]] + data.targets, after[:, [0, 2]], rtol=1e-12)
    assert np.array_equal(data.inputs[:, 3], np.concatenate([e.commands for e in episodes]))


def test_a_change_over_two_periods_is_none_of_one():
    told = episode(6, 0)
    kept = [0, 1, 2, 4, 5, 6]  # the host was too late for sample 3
    late = replace(
        told,
        observations=told.observations[kept],
        states=told.states[kept],
        commands=told.commands[[0, 1, 2, 4, 5]],
    )
    whole, data = transitions([told], CHANNELS), transitions([late], CHANNELS)
    np.testing.assert_array_equal(data.inputs, whole.inputs[[0, 1, 5]])  # what acted just before sample 4 is not known
    np.testing.assert_array_equal(data.targets, whole.targets[[0, 1, 5]])
    torn = replace(told, observations=told.observations * np.array([2.0, *np.ones(6)]))
    with pytest.raises(DataError, match="no control period with both of its samples"):
        transitions([torn], CHANNELS)


@pytest.mark.parametrize("lags", [0, 1, 2])
def test_no_input_holds_a_command_that_acted_where_a_sample_is_missing(lags):
    channels = Channels(("tilt", *[f"command_{1 + k}" for k in range(lags)]), 0.15)
    told = episode(12, 0, channels.names)
    told = replace(told, states=channels.states(told.observations, told.commands))
    kept = np.delete(np.arange(13), 5)
    observations, commands = told.observations[kept], told.commands[kept[:-1]]
    late = replace(told, observations=observations, states=channels.states(observations, commands), commands=commands)
    data, whole = transitions([late], channels), transitions([told], channels)
    expected = [0, 1, 2, 3, *range(6 + lags, 12)]
    np.testing.assert_array_equal(data.inputs, whole.inputs[expected])
    np.testing.assert_array_equal(data.targets, whole.targets[expected])
    assert [len(part) for part in unbroken([late], channels)] == [4, 6 - lags]


def test_where_too_little_would_be_left_past_commands_are_taken_as_they_were_recorded():
    """Every third row is lost: no state has both of its past commands from periods that were recorded."""
    channels = Channels(("tilt", "command_1", "command_2"), 0.15)
    told = episode(30, 0, channels.names)
    kept = np.flatnonzero(np.arange(31) % 3 != 2)
    observations, commands = told.observations[kept], told.commands[kept[:-1]]
    poor = replace(told, observations=observations, states=channels.states(observations, commands), commands=commands)
    found = transitions([poor], channels)
    whole = np.flatnonzero(np.diff(kept) == 1)
    np.testing.assert_array_equal(found.inputs[:, 0], poor.states[whole, 0])
    assert [len(part) for part in unbroken([poor], channels)] == [1] * len(whole)


def test_an_episode_is_parted_where_samples_are_missing():
    told = episode(9, 0)
    kept = [0, 1, 2, 4, 6, 7, 8, 9]
    broken = replace(told, observations=told.observations[kept], states=told.states[kept], commands=told.commands[:7])
    first, last = unbroken([broken, episode(0, 1)], CHANNELS)
    np.testing.assert_array_equal(first.states, told.states[:3])
    np.testing.assert_array_equal(last.states, told.states[7:])
    np.testing.assert_array_equal(first.commands, told.commands[:2])
    np.testing.assert_array_equal(last.commands, told.commands[5:7])
    assert unbroken([told], CHANNELS) == [told]


def test_samples_do_not_tell_where_the_robot_was():
    placed = Channels(("position", "tilt", "speed", "position_integral"), 0.15, 0.02)
    told = episode(5, 0, placed.names)
    data = transitions([told], placed)
    np.testing.assert_array_equal(data.inputs, np.column_stack([told.states[:-1, 1:3], told.commands]))
    np.testing.assert_allclose(data.targets, np.diff(told.states[:, 1:3], axis=0), rtol=1e-12)


def test_an_episode_with_other_channels_is_refused_with_both_lists():
    with pytest.raises(DataError, match="Episode 1 has the state channels tilt, speed; expected are tilt, command_1"):
        transitions([episode(5, 0), episode(5, 1, ("tilt", "speed"))], CHANNELS)


def test_mixed_control_periods_are_refused():
    with pytest.raises(DataError, match=r"control periods of 0\.01 s, 0\.02 s; a model"):
        transitions([episode(5, 0), episode(5, 1, period=np.float64(0.01))], CHANNELS)


def test_control_periods_that_differ_by_rounding_are_one():
    told = [episode(5, 0), episode(5, 1)]
    alike = [told[0], replace(told[1], control_period=np.nextafter(0.02, 1.0))]
    for found, expected in zip(transitions(alike, CHANNELS), transitions(told, CHANNELS), strict=True):
        np.testing.assert_array_equal(found, expected)
    with pytest.raises(DataError, match=r"control periods of 0\.02 s, 0\.020002 s"):
        transitions([told[0], replace(told[1], control_period=0.020002)], CHANNELS)


def test_episodes_of_another_control_period_than_the_state_are_refused():
    with pytest.raises(DataError, match=r"a control period of 0\.02 s; expected is 0\.021 s.*by robot="):
        transitions([episode(5, 0)], replace(CHANNELS, control_period=0.021))
    assert len(transitions([episode(5, 0)], replace(CHANNELS, control_period=0.02)).inputs) == 5


@pytest.mark.parametrize("episodes", [[], [episode(0, 0)]])
def test_no_samples_at_all_is_an_error(episodes):
    with pytest.raises(DataError, match=f"both of its samples in {len(episodes)} episodes"):
        transitions(episodes, CHANNELS)


def test_residuals_are_what_f_leaves():
    data = transitions([episode(20, 0)], CHANNELS)
    f = condition(data.inputs, data.targets, np.ones((2, 4)), np.ones(2), np.full(2, 1e-8))
    assert np.abs(residuals(data, f).targets).max() < 1e-6 * np.abs(data.targets).max()
    zero = condition(data.inputs, 0.0 * data.targets, np.ones((2, 4)), np.ones(2), np.ones(2))
    np.testing.assert_allclose(residuals(data, zero).targets, data.targets)


def test_residuals_of_a_model_of_another_state_are_refused():
    data = transitions([episode(20, 0)], CHANNELS)
    f = condition(data.inputs[:, :3], data.targets, np.ones((2, 3)), np.ones(2), np.ones(2))
    with pytest.raises(DataError, match="4 inputs and 2 targets; the model f has 3 and 2"):
        residuals(data, f)
