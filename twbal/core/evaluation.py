"""What real trials say about a policy and about the model that predicted them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from twbal.core.episode import Episode
from twbal.core.errors import ConfigError, DataError
from twbal.core.gaussian import HALF_WIDTH_95, Array, Gaussian
from twbal.core.plant import Observation

StateCost = Callable[[Array], Array]
"""Cost c(x) of each of T states: from (T, D) to (T,), each in [0, 1]."""

_TILT, _WHEEL_ANGLE = Observation._fields.index("tilt"), Observation._fields.index("wheel_angle")


@dataclass(frozen=True)
class SuccessCriterion:
    """When a trial counts as a success.

    Attributes:
        tilt_limit: the tilt must never pass this [rad].
        settled_tilt_limit: from `settle_step` on the tilt must stay under this [rad].
        settle_step: control periods the policy has for recovering from its start.
        steps: control periods that a trial lasts.

    Raises:
        ConfigError: no trial could meet it, or every trial would.
    """

    tilt_limit: float
    settled_tilt_limit: float
    settle_step: int
    steps: int

    def __post_init__(self) -> None:
        if not 0 < self.settled_tilt_limit <= self.tilt_limit:
            raise ConfigError(
                "settled_tilt_limit must be positive and at most tilt_limit; "
                f"found {self.settled_tilt_limit} and {self.tilt_limit} rad."
            )
        if not 0 <= self.settle_step <= self.steps or self.steps < 1:
            raise ConfigError(
                f"settle_step must lie within the trial; found step {self.settle_step} of a trial of {self.steps}."
            )


def succeeded(episode: Episode, rule: SuccessCriterion) -> bool:
    """Whether the robot balanced: `rule.steps` long, inside the limit throughout and settled from `settle_step` on."""
    tilt = np.abs(episode.tilt[: rule.steps + 1])
    lasted = len(episode) >= rule.steps
    return bool(lasted and tilt.max() <= rule.tilt_limit and tilt[rule.settle_step :].max() < rule.settled_tilt_limit)


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


def widened(
    predicted: Sequence[Gaussian], episodes: Sequence[Episode], measured: Sequence[int]
) -> tuple[Gaussian, ...]:
    """The prediction with as much more variance as rollouts of the same policy show to be missing.

    What a model gets wrong again and again (a dead zone smoothed over, a speed that is off) is no noise, and no bands
    of its noise hold it. So each measured channel gets the smallest variance v, the same at all steps, with which the
    95 % bands hold 95 % of what these episodes measured: by split conformal prediction the same share of further
    rollouts, were the steps of a rollout independent. Past commands are left as they are.

    Args:
        predicted: p(x_t) for t = 0 .. H, of D channels as the sensors show them.
        episodes: of the predicted policy, driven without exploration; best as long as the prediction.
        measured: channels to widen.

    Raises:
        DataError: see `coverage95`.
    """
    error, sd = _errors(predicted, episodes, measured)
    more = np.zeros(len(predicted[0].mean))
    more[list(measured)] = np.maximum(0.0, np.quantile((error / HALF_WIDTH_95) ** 2 - sd**2, 0.95, axis=0))
    first, *later = predicted
    return (first, *(Gaussian(p.mean, p.covariance + np.diag(more)) for p in later))


def _errors(predicted: Sequence[Gaussian], episodes: Sequence[Episode], measured: Sequence[int]) -> tuple[Array, Array]:
    """Real less predicted states of all steps from t = 1 on that were reached, and their predicted sd, (n, E) each."""
    mean = np.array([p.mean for p in predicted])  # (H + 1, D)
    sd = np.array([p.sd for p in predicted])  # (H + 1, D)
    errors, sds = [], []
    for episode in episodes:
        if episode.states.shape[1] != mean.shape[1]:
            raise DataError(
                f"The prediction has {mean.shape[1]} channels, the episode {episode.states.shape[1]} "
                f"({', '.join(episode.channels)}). Compare a policy with trials of the same state."
            )
        ahead = min(len(episode.states), len(mean))
        errors.append((episode.states[1:ahead] - mean[1:ahead])[:, list(measured)])
        sds.append(sd[1:ahead, list(measured)])
    if not sum(map(len, errors)):
        raise DataError(f"None of the {len(episodes)} episodes reached the first predicted step; nothing to compare.")
    return np.concatenate(errors), np.concatenate(sds)


def real_cost(episode: Episode, cost: StateCost, horizon: int) -> float:
    """Long-term cost Σ_{t=1..H} c(x_t) of what the robot did, H = `horizon` (eq. 9, without expectation).

    A step that the robot did not reach counts as 1, whatever ended the rollout: it is not balancing then. x_0 is left
    out, as no policy can change it; the cost lies in [0, H].
    """
    states = episode.states[1 : horizon + 1]
    seen = float(np.sum(cost(states))) if len(states) else 0.0
    return seen + horizon - len(states)


def positions(episode: Episode, wheel_radius: float) -> Array:
    """How far the axle has rolled since the start, (T + 1,) [m].

    The encoders see the wheel relative to the body, so over ground it has turned by wheel angle + tilt. `wheel_radius`
    is that of the data sheet [m].
    """
    turned = episode.observations[:, _WHEEL_ANGLE] + episode.observations[:, _TILT]
    travelled: Array = wheel_radius * (turned - turned[0])
    return travelled


def drift(episode: Episode, wheel_radius: float) -> float:
    """Distance between where the robot started and where it ended [m]."""
    return float(abs(positions(episode, wheel_radius)[-1]))
