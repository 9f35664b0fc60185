"""`prediction.pt`: what is expected of a policy, and what else was considered."""

import re
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from twbal.core.errors import CheckpointError
from twbal.core.gaussian import Array, Gaussian
from twbal.core.payload import Payload
from twbal.io.checkpoint import load_checkpoint, save_checkpoint
from twbal.search.optimise import SearchResult
from twbal.search.predictor import Predictor
from twbal.search.task import PolicyCandidate

KIND = "prediction"
_EARLIER = re.compile(r"policy (\d+)")


@dataclass(frozen=True)
class Assessment:
    """What was thought of a policy before it went to the robot.

    Attributes:
        origin: where its search began, or which earlier policy it is.
        cost: expected long-term cost over the horizon (eq. 9).
        judged_success: share of the long model rollouts that balanced.
        judged_cost: mean cost of a step in them.
        earlier: which of the earlier policies that the search was given it is; None for what the search found.
        success_probability: that a trial succeeds, by the robots that `judged_success` counts, never 0 or 1; None in
            older files.
        margin: share of the robots that changed under which it succeeds; None where that was not asked.
    """

    origin: str
    cost: float
    judged_success: float
    judged_cost: float
    earlier: int | None
    success_probability: float | None = None
    margin: float | None = None


@dataclass(frozen=True)
class PredictedBy:
    """A prediction of the cost under the best policy, and how well it fits rollouts.

    Attributes:
        by: what predicts.
        cost: expected long-term cost over the horizon (eq. 9).
        crps: of the predicted states on rollouts of that policy; None where there were none to score it on.
        detail: how robots were drawn, where not as for the search, in words.
    """

    by: Predictor
    cost: float
    crps: float | None = None
    detail: str = ""


@dataclass(frozen=True)
class Prediction:
    """What is in a `prediction.pt`.

    Attributes:
        channels: names of the D state channels.
        states: p(x_t) for t = 0 .. H under the best policy, as the sensors show them.
        best: what was thought of that policy.
        candidates: the same for all that were judged, the best first.
        predictors: what predicted `states`, and what else could have.
        unknown: (H + 1, D), how much of the states' variances is due to what is not known of the robot, while the rest
            varies from rollout to rollout; None where that is not told, as by f + g and in older files.
    """

    channels: tuple[str, ...]
    states: tuple[Gaussian, ...]
    best: Assessment
    candidates: tuple[Assessment, ...]
    predictors: tuple[PredictedBy, ...]
    unknown: Array | None = None

    @property
    def cost(self) -> float:
        """Expected long-term cost over the horizon (eq. 9), by what predicted the states."""
        return self.predictors[0].cost

    def unknown_share(self, channel: int) -> float | None:
        """Share of the variance of a channel over t = 1 .. H that is due to what is not known of the robot."""
        if self.unknown is None:
            return None
        total = sum(float(state.sd[channel]) ** 2 for state in self.states[1:])
        return float(self.unknown[1:, channel].sum()) / total if total else None


def prediction_of(result: SearchResult) -> Prediction:
    """What a search says, without the policies."""
    candidates = tuple(_assessment(candidate) for candidate in result.candidates)
    predictors = tuple(PredictedBy(each.by, each.cost, each.crps, each.detail) for each in result.predictions)
    states = result.predictions[0].states
    unknown = result.predictions[0].unknown
    return Prediction(result.best.policy.channels, states, _assessment(result.best), candidates, predictors, unknown)


def save_prediction(path: Path, prediction: Prediction) -> None:
    """Write a `prediction.pt`."""
    payload: dict[str, Any] = {
        "channels": list(prediction.channels),
        "mean": np.array([state.mean for state in prediction.states]),  # (H + 1, D)
        "covariance": np.array([state.covariance for state in prediction.states]),  # (H + 1, D, D)
        "best": asdict(prediction.best),
        "candidates": [asdict(candidate) for candidate in prediction.candidates],
        "predictors": [{**asdict(each), "by": each.by.value} for each in prediction.predictors],
        "unknown": prediction.unknown,  # (H + 1, D)
    }
    save_checkpoint(path, KIND, payload)


def load_prediction(path: Path) -> Prediction:
    """Read a `prediction.pt`.

    Raises:
        CheckpointError: it cannot be read, or holds no prediction.
    """
    payload = load_checkpoint(path, KIND)
    try:
        return _prediction(Payload("prediction", payload))
    except CheckpointError as error:
        raise CheckpointError(f"The prediction in {path} cannot be used. {error}") from error


def _prediction(found: Payload) -> Prediction:
    channels = found.texts("channels")
    means = found.numbers("mean", (-1, len(channels)))
    covariances = found.numbers("covariance", (len(means), len(channels), len(channels)))
    best = _saved_assessment(found.part("best"))
    return Prediction(
        channels=channels,
        states=tuple(Gaussian(mean, covariance) for mean, covariance in zip(means, covariances, strict=True)),
        best=best,
        candidates=tuple(_saved_assessment(Payload("candidate", each)) for each in found.items("candidates")),
        predictors=_predictors(found, best, len(means) - 1),
        unknown=_unknown(found, means.shape),
    )


def _unknown(found: Payload, shape: tuple[int, ...]) -> Array | None:
    is_present = "unknown" in found.names and found["unknown"] is not None
    return found.numbers("unknown", shape) if is_present else None


def _predictors(found: Payload, best: Assessment, horizon: int) -> tuple[PredictedBy, ...]:
    """What predicted; in an older file that is the model, and its cost that of the best policy."""
    if "predictors" not in found.names:
        return (PredictedBy(Predictor.MODEL, best.cost),)
    parts = [Payload("predictor", each) for each in found.items("predictors")]
    unknown = [part.text("by") for part in parts if part.text("by") not in set(Predictor)]
    if unknown or not parts:
        raise CheckpointError(
            f"The prediction's predictors must be one or more of: {', '.join(Predictor)}; found "
            f"{unknown[0][:40] if unknown else 'none'}. Was the file changed, or made by a newer twbal?"
        )
    return tuple(
        PredictedBy(
            Predictor(part.text("by")),
            part.number("cost", 0.0, float(horizon)),
            None if part["crps"] is None else part.number("crps", 0.0),
            part.text("detail"),
        )
        for part in parts
    )


def _saved_assessment(found: Payload) -> Assessment:
    cost, success, mean = (found.number(name) for name in ("cost", "judged_success", "judged_cost"))
    optional = [_share(found, name) for name in ("success_probability", "margin")]
    return Assessment(found.text("origin"), cost, success, mean, _earlier(found), *optional)


def _share(found: Payload, name: str) -> float | None:
    """A number from 0 to 1 that may be missing, as in an older file."""
    is_present = name in found.names and found[name] is not None
    return found.number(name, 0.0, 1.0) if is_present else None


def _earlier(found: Payload) -> int | None:
    """Which earlier policy an assessment is of; an older file says `policy 1` in its origin alone."""
    if "earlier" not in found.names:
        written = _EARLIER.fullmatch(found.text("origin"))
        return int(written[1]) if written else None
    return None if found["earlier"] is None else int(found.number("earlier", 0, 1e9))


def _assessment(candidate: PolicyCandidate) -> Assessment:
    validation = candidate.judged
    return Assessment(
        origin=candidate.origin,
        cost=candidate.cost,
        judged_success=validation.success,
        judged_cost=validation.cost,
        earlier=candidate.earlier,
        success_probability=candidate.success_probability,
        margin=None if candidate.robots is None else candidate.robots.margin,
    )
