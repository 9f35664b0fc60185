"""A robot in a few lines, and recipes that learn it in a moment."""

from functools import partial

import numpy as np

from twbal.core.channels import Channels
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.models.fit import fit_gp
from twbal.models.fit_settings import FitSettings
from twbal.models.recipe import ModelRecipe
from twbal.models.smoothing import SmoothingSettings

CHANNELS = Channels(("tilt", "tilt_rate", "command_1"), 0.15)
SETTINGS = FitSettings(
    starts=2,
    perturbation=0.5,
    screening_points=100,
    finalists=1,
    iterations=100,
    max_signal_to_noise=1000.0,
    max_relative_length_scale=100.0,
)
FIT = partial(fit_gp, settings=SETTINGS)
SMOOTHING = SmoothingSettings(
    rounds=2,
    linearisations=2,
    iterations=30,
    sensor_prior_sd=1.0,
    process_prior_sd=2.0,
    sensor_sd={"tilt": 2e-3, "tilt_rate": 2e-3},
)
RAW = ModelRecipe(FIT, FIT, keep_f_variance=False, smoothing=None)
SMOOTHED = ModelRecipe(FIT, FIT, keep_f_variance=False, smoothing=SMOOTHING)


def episode(steps, seed, gain, source):
    """A robot whose next tilt rate feels the present and the past command, and sine of the tilt."""
    rng = np.random.default_rng(seed)
    commands = rng.uniform(-2, 2, steps)
    states = np.zeros((steps + 1, 3))
    states[0, :2] = rng.normal(0, 0.2, 2)
    for t, command in enumerate(commands):
        tilt, rate, past = states[t]
        states[t + 1] = tilt + 0.1 * rate, rate + 0.3 * np.sin(tilt) - gain * (0.2 * command + 0.1 * past), command
    noise = np.array([1e-3, 1e-3, 0.0]) * rng.standard_normal(states.shape)
    observations = np.zeros((steps + 1, 7))
    observations[:, 0] = 0.02 * np.arange(steps + 1)
    provenance = Provenance("paper", source)
    return Episode(CHANNELS.names, 0.02, observations, states + noise, commands, Outcome.COMPLETED, provenance)
