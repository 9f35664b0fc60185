import numpy as np
import pytest

from twbal.channels import Channels
from twbal.errors import CheckpointError, ConfigError
from twbal.models.dynamics import DynamicsModel, observation_noise
from twbal.models.fit import FitSettings, fit_gp
from twbal.models.gp import condition

CHANNELS = Channels(("tilt", "command_2", "tilt_rate", "command_1"), 0.15)
SETTINGS = FitSettings(
    starts=2,
    perturbation=0.5,
    screening_points=200,
    finalists=1,
    iterations=100,
    max_signal_to_noise=1000.0,
    max_relative_length_scale=100.0,
)


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
    return DynamicsModel(CHANNELS, random_gp(1), random_gp(2), keep_f_variance=False)


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
    model = DynamicsModel(CHANNELS, random_gp(1), random_gp(2), keep_f_variance=keep)
    inputs = np.random.default_rng(0).standard_normal((6, 5))
    step = model.step_distribution(inputs[:, :4], inputs[:, 4])
    expected = model.g.predict(inputs).variance + keep * model.f.predict(inputs).variance
    np.testing.assert_allclose(step.variance, expected, rtol=1e-12)
    np.testing.assert_allclose(step.mean, model.step_mean(inputs[:, :4], inputs[:, 4]))


def test_without_g_the_papers_model_is_certain():
    model = DynamicsModel(CHANNELS, random_gp(1), None, keep_f_variance=False)
    assert not model.step_distribution(np.ones((3, 4)), np.ones(3)).variance.any()
    assert np.array_equal(model.noise_variance, model.f.noise_variance)


def test_slope_equals_finite_differences(model):
    point, h = np.array([0.3, -0.2, 0.5, 0.1, -0.4]), 1e-6
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


def test_a_payload_without_f_says_so(model):
    payload = model.to_payload()
    del payload["f"]
    with pytest.raises(CheckpointError, match="missing: f"):
        DynamicsModel.from_payload(payload)


def test_a_model_of_another_state_is_refused():
    with pytest.raises(ConfigError, match="5 inputs and 2 outputs; found 4 and 2"):
        DynamicsModel(CHANNELS, random_gp(1, inputs=4), None, keep_f_variance=False)


def test_measurement_noise_is_recovered_from_linear_data():
    channels = Channels(("tilt", "tilt_rate"), 0.15)
    sd = np.array([0.02, 0.05])
    rng = np.random.default_rng(0)
    states, commands = rng.standard_normal((400, 2)), rng.uniform(-5, 5, 400)
    after = states @ np.array([[1.0, 0.1], [0.3, 0.8]]).T + np.outer(commands, [0.02, 0.3])
    seen, seen_after = (x + sd * rng.standard_normal(x.shape) for x in (states, after))
    inputs = np.column_stack([seen, commands])
    f = fit_gp(inputs, seen_after - seen, SETTINGS, seed=0).gp
    model = DynamicsModel(channels, f, None, keep_f_variance=False)
    np.testing.assert_allclose(np.sqrt(observation_noise(model, inputs)), sd, rtol=0.1)
    assert (f.noise_variance > 1.5 * sd**2).all()  # the residual's noise counts the measurement twice
