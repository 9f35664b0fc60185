"""How well predictions of states held, and how much wider they must be to hold."""

from collections.abc import Sequence

import numpy as np

from twbal.core.episode import Episode
from twbal.core.errors import DataError
from twbal.core.gaussian import HALF_WIDTH_95, Array, Gaussian

_HELD = 0.95  # share of what was measured that calibrated bands hold
_NARROWEST = 0.5  # factor on a standard deviation


def coverage95(predicted: Sequence[Gaussian], episodes: Sequence[Episode], measured: Sequence[int]) -> float:
    """Share of the real states that lie inside the predicted mean ± 1.96 standard deviations.

    Counted are all steps t = 1 .. H that the episodes reached; x_0 is given, not predicted.

    Args:
        predicted: p(x_t) for t = 0 .. H, of D channels as the sensors show them: with their noise.
        episodes: trials of the policy that was predicted.
        measured: channels to count; past commands are no prediction.

    Raises:
        DataError: no episode reached step 1, or the episodes have other channels than the prediction.
    """
    error, sd = _errors(predicted, episodes, measured)
    return float((np.abs(error) <= HALF_WIDTH_95 * sd).mean())


def half_widths95(predicted: Sequence[Gaussian], channel: int) -> Array:
    """Half widths of the 95 % band of one channel, t = 1 .. H, in the channel's unit, (H,)."""
    return HALF_WIDTH_95 * np.array([p.sd[channel] for p in predicted[1:]])


def calibrated(
    predicted: Sequence[Gaussian], episodes: Sequence[Episode], measured: Sequence[int]
) -> tuple[Gaussian, ...]:
    """The prediction with bands as wide as rollouts of the same policy ask for.

    What a model gets wrong again and again (a dead zone smoothed over, a speed that is off) is no noise, and no bands
    of its noise hold it. So each measured channel gets the smallest variance v, the same at all steps, with which the
    95 % bands hold 95 % of what these episodes measured: by split conformal prediction (Vovk, Gammerman and Shafer,
    Algorithmic Learning in a Random World, Springer 2005) the same share of further rollouts, were the steps of a
    rollout independent. A channel whose bands hold more than 95 % without it gets narrower ones: its standard
    deviation is multiplied by the root of the factor with which they would hold 95 %. Only half of the way, in
    logarithms, because the steps of a rollout are much alike, and a few rollouts show less than all that can come; and
    to half of it at most. Past commands are left as they are.

    Args:
        predicted: p(x_t) for t = 0 .. H, of D channels as the sensors show them.
        episodes: of the predicted policy, driven without exploration; best as long as the prediction.
        measured: channels to calibrate.

    Raises:
        DataError: see `coverage95`.
    """
    error, sd = _errors(predicted, episodes, measured)
    variance = (error / HALF_WIDTH_95) ** 2  # that the band needs to hold this error, (n, E)
    more, factor = np.zeros(len(predicted[0].mean)), np.ones(len(predicted[0].mean))
    more[list(measured)] = np.maximum(0.0, np.quantile(variance - sd**2, _HELD, axis=0))
    needed = np.quantile(variance / np.maximum(sd**2, np.finfo(float).tiny), _HELD, axis=0)  # of the variance, a share
    factor[list(measured)] = np.clip(needed, _NARROWEST**4, 1.0) ** 0.25
    first, *later = predicted
    scale = np.outer(factor, factor)
    return (first, *(Gaussian(p.mean, scale * p.covariance + np.diag(more)) for p in later))


def reached_states(predicted: Sequence[Gaussian], episodes: Sequence[Episode]) -> Array:
    """Real states at the predicted steps t = 1 .. H, (N, H, D); NaN where an episode had ended before.

    Raises:
        DataError: see `coverage95`.
    """
    horizon, width = len(predicted) - 1, len(predicted[0].mean)
    real = np.full((len(episodes), horizon, width), np.nan)
    for place, episode in zip(real, episodes, strict=True):
        if episode.states.shape[1] != width:
            raise DataError(
                f"The prediction has {width} channels, the episode {episode.states.shape[1]} "
                f"({', '.join(episode.channels)}). Compare a policy with trials of the same state."
            )
        ahead = episode.states[1 : horizon + 1]
        place[: len(ahead)] = ahead
    if np.isnan(real).all():
        raise DataError(f"None of the {len(episodes)} episodes reached the first predicted step; nothing to compare.")
    return real


def _errors(predicted: Sequence[Gaussian], episodes: Sequence[Episode], measured: Sequence[int]) -> tuple[Array, Array]:
    """Real less predicted states of all steps from t = 1 on that were reached, and their predicted sd, (n, E) each."""
    real = reached_states(predicted, episodes)
    there = ~np.isnan(real[..., 0])  # (N, H)
    mean = np.array([p.mean for p in predicted[1:]])  # (H, D)
    sd = np.broadcast_to([p.sd for p in predicted[1:]], real.shape)
    return (real - mean)[there][:, list(measured)], sd[there][:, list(measured)]
