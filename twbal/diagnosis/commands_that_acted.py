"""A diagnosis with the commands that acted, where a robot did not get all of those that were sent."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array, Mask
from twbal.diagnosis.findings import Findings
from twbal.diagnosis.held_commands import acting
from twbal.diagnosis.lost_commands import LostFound, lost_commands
from twbal.diagnosis.lost_commands_record import CommandLoss
from twbal.diagnosis.model_comparison import ModelComparison
from twbal.sysid.held_out import Split
from twbal.sysid.recording import Recording

_SEARCHES = 3  # of effects, at most, after lost commands were found


class WithoutLosses(NamedTuple):
    """What comes of it.

    Attributes:
        findings: by the commands that acted.
        split: the data, with the commands that acted.
        loss: how many others there were; None where there were none.
    """

    findings: Findings
    split: Split
    loss: CommandLoss | None


def without_lost_commands(
    found: Findings,
    split: Split,
    search: Callable[[Sequence[Recording]], Findings],
    progress: Callable[[str], None],
) -> WithoutLosses:
    """Search the effects again with the commands that acted, if the robot did not get some of those that were sent.

    Lost commands make a model's noise large, and its delay long. By the model that is found without them they are asked
    for again, and show more clearly. What acted is told of held-out data, too, by the model that was found.

    Args:
        found: with the commands as sent.
        split: the data, with the commands as sent.
        search: finds the effects that recordings show to be missing.
        progress: is told what is being done.
    """
    told: LostFound | None = None
    comparison = found.comparison
    for _ in range(_SEARCHES):
        if comparison is None:
            break
        data = replace(comparison.data, recordings=split.fitted)
        now = lost_commands(data, comparison.chosen.fit.model, told and told.lost)
        if now is None or (told is not None and _are_alike(now.lost, told.lost)):
            break
        told = now
        progress(f"{told.record.share:.1%} of the commands were lost; the effects are searched again without these")
        found = search([_with(recording, lost) for recording, lost in zip(split.fitted, told.lost, strict=True)])
        comparison = found.comparison
    if told is None:
        return WithoutLosses(found, split, None)
    fitted = tuple(_with(recording, lost) for recording, lost in zip(split.fitted, told.lost, strict=True))
    kept_back = split.kept_back if comparison is None else _kept_back(comparison, split, told.lost)
    return WithoutLosses(found, split._replace(fitted=fitted, kept_back=kept_back), told.record)


def _kept_back(comparison: ModelComparison, split: Split, lost: Sequence[Mask]) -> tuple[Recording, ...]:
    """What was kept back, with the commands that acted."""
    model = comparison.chosen.fit.model
    data = replace(comparison.data, recordings=split.kept_back)
    begun = [np.zeros(len(recording), dtype=bool) for recording in split.kept_back]
    if split.are_ends:
        for whole, first in zip(begun, lost, strict=True):
            whole[: len(first)] = first
    else:
        model = model._replace(offsets=())
    told = lost_commands(data, model, begun)
    masks = begun if told is None else list(told.lost)
    if split.are_ends:  # what was fitted does not count there, and so tells nothing
        for whole, first in zip(masks, lost, strict=True):
            whole[: len(first)] = first
    return tuple(_with(recording, mask) for recording, mask in zip(split.kept_back, masks, strict=True))


def _with(recording: Recording, lost: Mask) -> Recording:
    """The recording with the commands that acted."""
    commands: Array = acting(recording.commands, lost)
    return replace(recording, commands=commands)


def _are_alike(a: Sequence[Mask], b: Sequence[Mask]) -> bool:
    return all(np.array_equal(one, other) for one, other in zip(a, b, strict=True))
