from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.stats

from twbal.core.channels import Channels
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import ConfigError
from twbal.models.fit import fit_gp
from twbal.models.fit_settings import FitSettings
from twbal.models.recipe import ModelRecipe
from twbal.models.smoothing import NoiseLevels, SmoothingSettings, _filter, samples, smooth

CHANNELS = Channels(("tilt", "command_1", "tilt_rate"), 0.15)
MEASURED = [0, 2]
SLOPE = np.array([[0.0, 0.0, 0.1, 0.0], [-0.4, 0.05, -0.2, 0.3]])  # of the change, by (state, command)
SENSORS, PROCESS = np.array([0.03, 0.2]) ** 2, np.array([0.02, 0.05]) ** 2
SETTINGS = SmoothingSettings(
    rounds=1, linearisations=2, iterations=60, sensor_prior_sd=1.0, process_prior_sd=2.0, sensor_sd={"tilt": 0.02}
)
PRIOR = NoiseLevels(9.0 * SENSORS, 0.1 * PROCESS)  # off by a factor of three in the standard deviation


def linear_model():
    """A stand-in for f + g that is linear exactly, where the smoother is exact."""
    return SimpleNamespace(
        channels=CHANNELS,
        change=lambda inputs: inputs @ SLOPE.T,
        change_slope=lambda inputs: np.tile(SLOPE, (len(inputs), 1, 1)),
        f=SimpleNamespace(mean=lambda inputs: np.zeros((len(inputs), 2))),
    )


def episode(names, states, commands):
    observations = np.zeros((len(states), 7))
    observations[:, 0] = 0.02 * np.arange(len(states))
    provenance = Provenance("toy", "robot")
    return Episode(names, 0.02, observations, states, commands, Outcome.COMPLETED, provenance)


def drive(seed, steps):
    """An episode of the linear system as its sensors show it, and its true states."""
    rng = np.random.default_rng(seed)
    commands = rng.standard_normal(steps)
    truth = np.zeros((steps + 1, 3))
    truth[0, MEASURED] = rng.standard_normal(2)
    for t, command in enumerate(commands):
        change = SLOPE @ [*truth[t], command] + np.sqrt(PROCESS) * rng.standard_normal(2)
        truth[t + 1] = truth[t, 0] + change[0], command, truth[t, 2] + change[1]
    seen = truth.copy()
    seen[:, MEASURED] += np.sqrt(SENSORS) * rng.standard_normal((steps + 1, 2))
    return episode(CHANNELS.names, seen, commands), truth


def test_noise_levels_are_recovered_from_a_prior_that_is_off_by_three():
    episodes = [drive(seed, 200)[0] for seed in range(8)]
    found, _ = smooth(linear_model(), episodes, PRIOR, SETTINGS)
    np.testing.assert_allclose(np.sqrt(found.sensors), np.sqrt(SENSORS), rtol=0.1)
    np.testing.assert_allclose(np.sqrt(found.process), np.sqrt(PROCESS), rtol=0.2)


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_the_filter_says_the_density_of_all_measurements_together(channels):
    """Against the joint normal distribution of all measurements after the first."""
    rng, steps = np.random.default_rng(channels), 5
    measured, ahead = rng.standard_normal((2, steps + 1, channels))
    slope = rng.standard_normal((steps, channels, channels))
    sensors, process = rng.uniform(0.1, 1.0, (2, channels))
    mean, parts = measured[0], [np.diag(np.sqrt(sensors))]  # of the state: x = mean + sum over parts times unit noises
    means, rows = [], []
    for t in range(steps):
        mean = ahead[t] + slope[t] @ (mean - measured[t])
        parts = [*(slope[t] @ part for part in parts), np.diag(np.sqrt(process))]
        means.append(mean)
        rows.append(np.hstack([*parts, np.zeros((channels, channels * (steps - t - 1)))]))
    joint = np.vstack(rows)
    covariance = joint @ joint.T + np.diag(np.tile(sensors, steps))
    density = scipy.stats.multivariate_normal(np.concatenate(means), covariance).logpdf(measured[1:].ravel())
    found = _filter(measured, np.ascontiguousarray(ahead[:steps]), slope, sensors, process)[0]
    assert found - 0.5 * channels * steps * np.log(2.0 * np.pi) == pytest.approx(density, rel=1e-10)


def test_a_firm_prior_holds_the_noise_levels():
    firm = replace(SETTINGS, sensor_prior_sd=1e-3, process_prior_sd=1e-3)
    found, _ = smooth(linear_model(), [drive(0, 100)[0]], PRIOR, firm)
    np.testing.assert_allclose(found.sensors, PRIOR.sensors, rtol=0.01)
    np.testing.assert_allclose(found.process, PRIOR.process, rtol=0.01)


def test_smoothed_states_are_the_least_squares_solution_over_the_whole_episode():
    seen, _ = drive(3, 30)
    levels, (smoothed,) = smooth(linear_model(), [seen], PRIOR, SETTINGS)
    steps, E = len(seen), 2
    rows, wanted = [], []
    for t in range(steps + 1):  # the measurements
        for a in range(E):
            row = np.zeros((steps + 1, E))
            row[t, a] = 1.0 / np.sqrt(levels.sensors[a])
            rows.append(row.ravel())
            wanted.append(seen.states[t, MEASURED[a]] / np.sqrt(levels.sensors[a]))
    for t in range(steps):  # the dynamics
        known = SLOPE[:, 1] * seen.states[t, 1] + SLOPE[:, 3] * seen.commands[t]
        for a in range(E):
            row = np.zeros((steps + 1, E))
            row[t + 1, a] += 1.0
            row[t, a] -= 1.0
            row[t] -= SLOPE[a, MEASURED]
            rows.append(row.ravel() / np.sqrt(levels.process[a]))
            wanted.append(known[a] / np.sqrt(levels.process[a]))
    expected = np.linalg.lstsq(np.array(rows), np.array(wanted), rcond=None)[0].reshape(steps + 1, E)
    np.testing.assert_allclose(smoothed[:, MEASURED], expected, atol=1e-9)
    assert np.array_equal(smoothed[:, 1], seen.states[:, 1])


def test_smoothed_states_are_nearer_to_the_truth_than_the_measurements():
    pairs = [drive(seed, 100) for seed in range(4)]
    _, smoothed = smooth(linear_model(), [e for e, _ in pairs], PRIOR, SETTINGS)
    truth = np.concatenate([t for _, t in pairs])[:, MEASURED]
    before = np.concatenate([e.states for e, _ in pairs])[:, MEASURED] - truth
    after = np.concatenate(smoothed)[:, MEASURED] - truth
    assert (after.std(0) < 0.7 * before.std(0)).all()


def test_samples_are_the_changes_of_the_smoothed_states_less_f():
    pairs = [drive(seed, 20) for seed in range(2)]
    data = samples([e for e, _ in pairs], [t for _, t in pairs], linear_model())
    truth = pairs[1][1]
    assert data.inputs.shape == (40, 4)
    np.testing.assert_allclose(data.inputs[20:, :3], truth[:-1])
    assert np.array_equal(data.inputs[20:, 3], pairs[1][0].commands)
    np.testing.assert_allclose(data.inputs[20:, MEASURED] + data.targets[20:], truth[1:, MEASURED])


def test_a_sensor_without_a_data_sheet_is_named():
    assert SETTINGS.sensor_variances(["tilt"]) == pytest.approx([4e-4])
    with pytest.raises(ConfigError, match="no entry for tilt_rate; it has: tilt"):
        SETTINGS.sensor_variances(["tilt", "tilt_rate"])


FIT = partial(
    fit_gp,
    settings=FitSettings(
        starts=2,
        perturbation=0.5,
        screening_points=200,
        finalists=1,
        iterations=100,
        max_signal_to_noise=1000.0,
        max_relative_length_scale=100.0,
    ),
)
SPEED = Channels(("speed",), 0.15)
DAMPING, SENSOR_SD = {"simulation": -0.2, "robot": -0.05}, 0.25


def coasting(seed, source, noise_sd, steps=60):
    """x' = x + damping x + 0.3 u + a little noise, with x of about 0.6 seen through noise."""
    rng = np.random.default_rng(seed)
    commands = rng.standard_normal(steps)
    x = np.zeros(steps + 1)
    x[0] = 0.5 * rng.standard_normal()
    for t, command in enumerate(commands):
        x[t + 1] = (1 + DAMPING[source]) * x[t] + 0.2 * command + 0.005 * rng.standard_normal()
    return episode(SPEED.names, (x + noise_sd * rng.standard_normal(steps + 1))[:, None], commands)


def test_a_missing_sample_parts_an_episode_and_is_no_noise():
    settings = replace(SETTINGS, rounds=2, sensor_sd={"speed": 0.1})
    recipe = ModelRecipe(FIT, FIT, keep_f_variance=False, smoothing=settings)
    f = recipe.learn_simulation([coasting(seed, "simulation", 0.0) for seed in range(3)], SPEED, seed=0).model
    whole = coasting(10, "robot", SENSOR_SD, steps=80)
    kept = np.delete(np.arange(81), [20, 41, 63])
    late = replace(
        whole, observations=whole.observations[kept], states=whole.states[kept], commands=whole.commands[kept[:-1]]
    )
    intact, broken = (recipe.learn_difference(f, [each], seed=0) for each in (whole, late))
    assert len(broken.data.inputs) == 80 - 2 * 3
    assert broken.model.process_noise[0] < 2.0 * intact.model.process_noise[0]


def test_smoothing_removes_the_spurious_damping_that_sensor_noise_in_the_inputs_makes():
    settings = replace(SETTINGS, rounds=3, sensor_sd={"speed": 0.1})
    raw = ModelRecipe(FIT, FIT, keep_f_variance=False, smoothing=None)
    smoothed = replace(raw, smoothing=settings)
    simulated = [coasting(seed, "simulation", 0.0) for seed in range(3)]
    f = raw.learn_simulation(simulated, SPEED, seed=0).model
    real = [coasting(10 + seed, "robot", SENSOR_SD) for seed in range(4)]
    before, after = (recipe.learn_difference(f, real, seed=0).model for recipe in (raw, smoothed))
    errors = [model.change_slope(np.zeros((1, 2)))[0, 0, 0] - DAMPING["robot"] for model in (before, after)]
    assert errors[0] < -0.07  # as damped as Var(noise) / Var(seen) says
    assert abs(errors[1]) < 0.3 * abs(errors[0])
    assert np.sqrt(after.observation_noise[0]) == pytest.approx(SENSOR_SD, rel=0.15)
    assert after.process_noise != after.g.noise_variance  # the fit to smoothed states no longer tells it
    assert np.sqrt(after.process_noise[0]) < 0.15 * np.sqrt(before.process_noise[0])
