"""What a run of Algorithm 1 achieved, read from the files that it left."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from twbal.channels import Channels
from twbal.cost import SaturatingCost
from twbal.episode import Episode
from twbal.evaluation import SuccessRule, coverage95, drift, real_cost, succeeded
from twbal.files import file_hash
from twbal.logs import read_episode
from twbal.stages.artefacts import episode_files
from twbal.stages.learning import Learned, Learning
from twbal.stages.manifest import Manifest
from twbal.stages.predictions import Prediction, load_prediction
from twbal.summary import Iteration, PolicyFile, SimData, Summary


@dataclass(frozen=True)
class Measures:
    """By what trials are measured.

    Attributes:
        rule: what makes a success.
        cost: of a state.
        horizon: over which costs are summed [control periods].
        channels: the state.
    """

    rule: SuccessRule
    cost: SaturatingCost
    horizon: int
    channels: Channels


@dataclass(frozen=True)
class Findings:
    """One iteration, read back.

    Attributes:
        iteration: its line of the summary.
        prediction: what the model expected; None where none was asked.
        trials: what the robot did.
    """

    iteration: Iteration
    prediction: Prediction | None
    trials: tuple[Episode, ...]


def episodes_in(folders: Sequence[Path]) -> tuple[Episode, ...]:
    """The episodes of run folders, in order."""
    return tuple(read_episode(file) for folder in folders for file in episode_files(str(folder)))


def findings(learning: Learning, root: Path, measures: Measures) -> list[Findings]:
    """What is known of each policy.

    Args:
        learning: which files belong to which policy.
        root: the run folder.
        measures: by what to measure.
    """
    found: list[Findings] = []
    for learned in learning.policies:
        prediction = load_prediction(root / learned.prediction_file) if learned.predicted else None
        trials = episodes_in([root / learned.trials]) if learned.trials else ()
        driven = episodes_in([root / folder for folder in learned.rollouts])
        note = _note(learned, prediction, _successes(trials, measures), [earlier.iteration for earlier in found])
        found.append(
            Findings(_iteration(learned, root, prediction, trials, driven, measures, note), prediction, trials)
        )
    return found


def summarise(found: Sequence[Findings], simulated: Sequence[Episode], robot: str, seed: int, wall_s: float) -> Summary:
    """The summary of a run; the best policy is the one with most successes, then with the lowest cost on the robot."""
    iterations = tuple(each.iteration for each in found)
    return Summary(
        robot=robot,
        seed=seed,
        wall_s=wall_s,
        sim=SimData(len(simulated), sum(map(len, simulated))),
        iterations=iterations,
        best_iteration=min(iterations, key=_rank).index,
    )


def _rank(iteration: Iteration) -> tuple[float, ...]:
    """Lower is better; where nothing was tried on the robot, what the long model rollouts said decides."""
    if iteration.real_cost is None:
        return (0.0, -(iteration.judged_success or 0.0), -iteration.index)
    return (-iteration.successes, iteration.real_cost, iteration.index)


def _iteration(
    learned: Learned,
    root: Path,
    prediction: Prediction | None,
    trials: Sequence[Episode],
    driven: Sequence[Episode],
    measures: Measures,
    note: str,
) -> Iteration:
    channels, policy = measures.channels, root / learned.policy_file
    costs = [real_cost(trial, measures.cost, measures.horizon) for trial in trials]
    return Iteration(
        index=learned.index,
        real_episodes=len(driven),
        real_samples=sum(map(len, driven)),
        real_seconds=round(sum((episode.duration for episode in driven), 0.0), 6),
        predicted_cost=min(prediction.best.cost, float(measures.horizon)) if prediction else None,
        real_cost=float(np.mean(costs)) if costs else None,
        successes=_successes(trials, measures),
        trials=len(trials),
        coverage95=coverage95(prediction.states, trials, channels.measured) if trials and prediction else None,
        fit_s=_seconds(learned.fits),
        search_s=_seconds(learned.searches),
        drift_m=float(np.median([drift(trial, channels.wheel_radius) for trial in trials])) if trials else None,
        judged_success=prediction.best.judged_success if prediction else None,
        policy=PolicyFile(str(policy), file_hash(policy)),
        note=note,
    )


def _note(learned: Learned, prediction: Prediction | None, successes: int, before: Sequence[Iteration]) -> str:
    """What a reader should know: that the search found nothing better, or that the robot says it is worse."""
    notes = []
    if learned.confirms:
        notes.append("The policy of the iteration before, which balances; the model has learned from driving it.")
    elif prediction and prediction.best.origin.startswith("policy "):
        notes.append(f"The search found nothing better than {prediction.best.origin}, which was driven again.")
    if learned.index and len(learned.searches) > 1:  # policy 0 comes of one search a round
        times = f"Searched {len(learned.searches)} times"
        notes.append(f"{times}: what came before did not balance in the mended simulation.")
    better = [iteration for iteration in before if iteration.successes > successes]
    if better:
        best = min(better, key=_rank)
        notes.append(f"Worse on the robot than policy {best.index} ({best.successes} of {best.trials}), which is kept.")
    return " ".join(notes)


def _successes(trials: Sequence[Episode], measures: Measures) -> int:
    return sum(succeeded(trial, measures.rule) for trial in trials)


def _seconds(manifests: Sequence[Manifest]) -> float:
    return round(sum(manifest.wall_s for manifest in manifests), 3)
