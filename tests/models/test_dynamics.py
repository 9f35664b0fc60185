import numpy as np
import pytest

from twbal.core.channels import Channels
from twbal.core.errors import CheckpointError, ConfigError
from twbal.models.dynamics import DynamicsModel
from twbal.models.gp import condition

CHANNELS = Channels(("tilt", "command_2", "tilt_rate", "command_1"), 0.15)
PROCESS, SENSORS = np.array([0.02, 0.3]), np.array([0.001, 0.05])


def random_gp(seed, outputs=2, inputs=5, samples=30):
    rng = np.random.default_rng(seed)
    return condition(
        rng.standard_normal((samples, inputs)),
        rng.standard_normal((samples, outputs)),
        rng.uniform(1.0, 3.0, (outputs, inputs)),
        rng.uniform(0.5, 2.0, outputs),
        rng.uniform(0.01, 0.1, outputs),
    )


@pytest.fixture
def model():
    return DynamicsModel(CHANNELS, random_gp(1), random_gp(2), False, PROCESS, SENSORS)


def test_past_commands_are_copied_exactly(model):
    states, commands = np.random.default_rng(0).standard_normal((6, 4)), np.arange(6.0)
    after = model.step_mean(states, commands)
    assert np.array_equal(after[:, 3], commands)
    assert np.array_equal(after[:, 1], states[:, 3])


def test_measured_channels_move_by_f_plus_g(model):
    states, commands = np.random.default_rng(0).standard_normal((6, 4)), np.arange(6.0)
    inputs = np.column_stack([states, commands])
    change = model.f.predict(inputs).mean + model.g.predict(inputs).mean
    after = model.step_mean(states, commands)
    np.testing.assert_allclose(after[:, 0], states[:, 0] + change[:, 0], rtol=1e-12)
    np.testing.assert_allclose(after[:, 2], states[:, 2] + change[:, 1], rtol=1e-12)


@pytest.mark.parametrize("keep", [False, True])
def test_the_variance_is_that_of_g_and_of_f_only_where_it_is_kept(keep):
    model = DynamicsModel(CHANNELS, random_gp(1), random_gp(2), keep, PROCESS, SENSORS)
    inputs = np.random.default_rng(0).standard_normal((6, 5))
    step = model.step_distribution(inputs[:, :4], inputs[:, 4])
    expected = model.g.predict(inputs).variance + keep * model.f.predict(inputs).variance
    np.testing.assert_allclose(step.variance, expected, rtol=1e-12)
    np.testing.assert_allclose(step.mean, model.step_mean(inputs[:, :4], inputs[:, 4]))


def test_without_g_the_papers_model_is_certain():
    model = DynamicsModel(CHANNELS, random_gp(1), None, False, PROCESS, SENSORS)
    assert not model.step_distribution(np.ones((3, 4)), np.ones(3)).variance.any()
    assert np.array_equal(model.noise_variance, model.f.noise_variance)


def test_slope_equals_finite_differences(model):
    point, h = np.array([[0.3, -0.2, 0.5, 0.1, -0.4]]), 1e-6
    numeric = [(model.change(point + h * e) - model.change(point - h * e))[0] / (2 * h) for e in np.eye(5)]
    np.testing.assert_allclose(model.change_slope(point)[0], np.transpose(numeric), atol=1e-8)


def test_payload_round_trip_predicts_the_same(model):
    again = DynamicsModel.from_payload(model.to_payload())
    states, commands = np.random.default_rng(0).standard_normal((6, 4)), np.arange(6.0)
    for one, other in zip(
        model.step_distribution(states, commands), again.step_distribution(states, commands), strict=True
    ):
        assert np.array_equal(one, other)
    assert again.channels == model.channels
    assert np.array_equal(again.process_noise, PROCESS)
    assert np.array_equal(again.observation_noise, SENSORS)


@pytest.mark.parametrize("part", ["f", "process_noise"])
def test_a_payload_without_a_part_says_so(model, part):
    payload = model.to_payload()
    del payload[part]
    with pytest.raises(CheckpointError, match=f"has no '{part}'"):
        DynamicsModel.from_payload(payload)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"wheel_radius": float("nan")}, "model's wheel_radius must be within"),
        ({"wheel_radius": "0.1"}, "wheel_radius must be a number"),
        ({"channels": [1, 2]}, "channels must be texts"),
        ({"keep_f_variance": 1}, "keep_f_variance must be a bool; found a int"),
        ({"process_noise": np.array([1.0])}, r"process_noise must be numbers of shape \(2\)"),
        ({"observation_noise": np.array([1.0, -1.0])}, "observation_noise must be within"),
        ({"f": 3}, "GP must be values by their names; found a int"),
        ({"wheel_radius": 10**400}, "wheel_radius must be within .* found inf"),
        ({"g": {}}, "has no 'centres'"),
        ({"f": {"length_scales": np.zeros((2, 5))}}, "length_scales must be within"),
        ({"f": {"centres": np.zeros(5)}}, r"centres must be numbers of shape \(any, any\)"),
        ({"f": {"weights": np.zeros((2, 1))}}, "weights must be numbers of shape"),
        ({"f": {"variance_matrix": np.array([[np.nan]])}}, "variance_matrix must be numbers of shape"),
        ({"f": {"signal_variance": np.array([np.inf, 1.0])}}, "signal_variance must be within"),
    ],
)
def test_a_payload_that_cannot_be_a_model_is_refused(model, change, message):
    payload = model.to_payload()
    changed = {k: {**payload[k], **v} if isinstance(v, dict) and v else v for k, v in change.items()}
    with pytest.raises(CheckpointError, match=message):
        DynamicsModel.from_payload({**payload, **changed})


PLACED = Channels(("position", "tilt", "speed", "command_1", "position_integral"), 0.15, 0.02)


@pytest.fixture
def placed():
    return DynamicsModel(PLACED, random_gp(1, inputs=4), random_gp(2, inputs=4), False, PROCESS, SENSORS)


def test_the_position_follows_the_speed_by_the_trapezoid_rule_and_its_integral_the_position_by_eulers(placed):
    states, commands = np.random.default_rng(0).standard_normal((6, 5)), np.arange(6.0)
    after = placed.step_mean(states, commands)
    p, _, v, _, q = states.T
    np.testing.assert_allclose(after[:, 0], p + 0.02 * (v + after[:, 2]) / 2, rtol=1e-12)
    np.testing.assert_allclose(after[:, 4], q + 0.02 * p, rtol=1e-12)
    assert np.array_equal(after[:, 3], commands)


def test_what_the_robot_does_is_the_same_at_any_place(placed):
    states, commands = np.random.default_rng(0).standard_normal((6, 5)), np.arange(6.0)
    elsewhere = states + np.array([30.0, 0.0, 0.0, 0.0, -7.0])
    gap = placed.step_mean(elsewhere, commands) - placed.step_mean(states, commands)
    np.testing.assert_allclose(gap, np.tile([30.0, 0.0, 0.0, 0.0, -7.0 + 0.02 * 30.0], (6, 1)), atol=1e-12)
    inputs = np.column_stack([states, commands])[:, [1, 2, 3, 5]]
    change = placed.f.mean(inputs) + placed.g.mean(inputs)
    np.testing.assert_allclose(placed.step_mean(states, commands)[:, [1, 2]], states[:, [1, 2]] + change, rtol=1e-12)


def test_slope_with_place_equals_finite_differences(placed):
    point, h = np.array([[0.3, -0.2, 0.5, 0.1, -0.4, 0.7]]), 1e-5  # rounding and curvature err alike here
    numeric = [(placed.change(point + h * e) - placed.change(point - h * e))[0] / (2 * h) for e in np.eye(6)]
    np.testing.assert_allclose(placed.change_slope(point)[0], np.transpose(numeric), atol=1e-8)


def test_payload_round_trip_keeps_the_control_period_and_older_ones_lack_it(placed, model):
    assert DynamicsModel.from_payload(placed.to_payload()).channels == PLACED
    old = {k: v for k, v in model.to_payload().items() if k != "control_period"}
    again = DynamicsModel.from_payload(old)
    states = np.random.default_rng(0).standard_normal((6, 4))
    assert np.array_equal(again.step_mean(states, np.ones(6)), model.step_mean(states, np.ones(6)))
    with pytest.raises(ConfigError, match="position needs the control period"):
        DynamicsModel.from_payload({k: v for k, v in placed.to_payload().items() if k != "control_period"})


def test_a_model_of_another_state_is_refused():
    with pytest.raises(ConfigError, match="5 inputs and 2 outputs; found 4 and 2"):
        DynamicsModel(CHANNELS, random_gp(1, inputs=4), None, False, PROCESS, SENSORS)
