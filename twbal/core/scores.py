"""Proper scores of predicted states: what a band is worth that is neither too narrow nor too wide.

Coverage alone is content with any band that is wide enough. The log predictive density and the continuous ranked
probability score (CRPS) are best, in expectation, for the true distribution only (Gneiting and Raftery, Strictly proper
scoring rules, prediction, and estimation, JASA 2007).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from twbal.core.coverage import reached_states
from twbal.core.episode import Episode
from twbal.core.gaussian import Array, Gaussian

_FEWEST = 3  # trials at a step: one that is left out, and two others with a spread


class Scores(NamedTuple):
    """How well normal distributions of the state foretold trials, each channel in units of its scale.

    Every value is a mean over the trials, the steps t = 1 .. H that they reached and the scored channels. A trial that
    fell is compared as far as it went, as `coverage95` has it: what a model says of later steps is not in these scores
    but in the predicted cost.

    Attributes:
        log_density: log predictive density, natural; more is better. None where a band has no width.
        crps: CRPS; less is better, 0 at least.
        crps_of_trials: that of the trials' own spread: of a trial under the mean and standard deviation, at each step,
            of all others. None unless three trials reached a step; later steps that fewer reached are left out.
        crps_ratio: CRPS of the prediction over that, both at the same steps; None where that is unknown or 0.
    """

    log_density: float | None
    crps: float
    crps_of_trials: float | None
    crps_ratio: float | None


def gaussian_crps(error: Array, sd: Array) -> Array:
    """CRPS ∫ (F(y) - 1[y ≥ x])² dy of N(m, sd²) at x, for error = x - m; |error| where sd is 0.

    With z = error / sd it is sd (z (2 Φ(z) - 1) + 2 φ(z) - 1 / √π) (Gneiting and Raftery 2007, eq. 21).
    """
    is_wide = sd > 0.0
    width = np.where(is_wide, sd, 1.0)
    z = error / width
    density = np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)
    found: Array = width * (z * (2.0 * ndtr(z) - 1.0) + 2.0 * density - 1.0 / np.sqrt(np.pi))
    return np.where(is_wide, found, np.abs(error))


def gaussian_log_density(error: Array, sd: Array) -> Array:
    """ln N(error; 0, sd²) for sd > 0."""
    found: Array = -0.5 * (error / sd) ** 2 - np.log(sd) - 0.5 * np.log(2.0 * np.pi)
    return found


def scores(
    predicted: Sequence[Gaussian], episodes: Sequence[Episode], measured: Sequence[int], scales: Array
) -> Scores | None:
    """Scores of a prediction against trials of the policy that was predicted.

    Args:
        predicted: p(x_t) for t = 0 .. H, of D channels as the sensors show them: with their noise.
        episodes: trials.
        measured: channels to score; past commands are no prediction.
        scales: (D,) in the channels' units, to make channels comparable: the widths of the cost. A channel with an
            infinite one is not scored.

    Returns:
        None where no channel is left to score.

    Raises:
        DataError: see `coverage95`.
    """
    scored = [i for i in measured if np.isfinite(scales[i])]
    if not scored:
        return None
    real = reached_states(predicted, episodes)[..., scored] / scales[scored]  # (N, H, E)
    mean = np.array([p.mean[scored] for p in predicted[1:]]) / scales[scored]  # (H, E)
    sd = np.array([p.sd[scored] for p in predicted[1:]]) / scales[scored]
    there = ~np.isnan(real[..., 0])  # (N, H)
    errors, widths = (real - mean)[there], np.broadcast_to(sd, real.shape)[there]
    shared = there & (there.sum(axis=0) >= _FEWEST)
    ours = gaussian_crps((real - mean)[shared], np.broadcast_to(sd, real.shape)[shared])
    theirs = float(_crps_of_others(real, shared).mean()) if shared.any() else None
    return Scores(
        log_density=float(gaussian_log_density(errors, widths).mean()) if (widths > 0.0).all() else None,
        crps=float(gaussian_crps(errors, widths).mean()),
        crps_of_trials=theirs,
        crps_ratio=float(ours.mean()) / theirs if theirs else None,
    )


def _crps_of_others(real: Array, shared: Array) -> Array:
    """CRPS of each trial under the mean and sd of the others at the same step.

    Args:
        real: (N, H, E), NaN where a trial had ended.
        shared: (N, H), where a trial is compared: at least two others are there.
    """
    steps = shared.any(axis=0)
    found = []
    for i, trial in enumerate(real):
        others = np.delete(real, i, axis=0)[:, steps]
        band = np.nanmean(others, axis=0), np.nanstd(others, axis=0, ddof=1)
        is_compared = shared[i, steps]
        found.append(gaussian_crps((trial[steps] - band[0])[is_compared], band[1][is_compared]))
    return np.concatenate(found)
