"""A diagnosis with the commands that acted, where a robot did not get all of those that were sent."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from twbal.core.errors import DataError
from twbal.core.gaussian import Mask
from twbal.diagnosis.findings import Findings
from twbal.diagnosis.held_commands import acting
from twbal.diagnosis.lost_commands import LostFound, lost_by, lost_commands
from twbal.diagnosis.model_comparison import ModelComparison
from twbal.diagnosis.side_findings import CommandLoss
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
    for again, and show more clearly, until the same effects are found again. What acted is told of held-out data, too,
    by the model that was found.

    Args:
        found: with the commands as sent.
        split: the data, with the commands as sent.
        search: finds the effects that recordings show to be missing.
        progress: is told what is being done.
    """
    as_sent, losses, before = found, None, None
    for _ in range(_SEARCHES):
        if found.comparison is None:
            break
        data = replace(found.comparison.data, recordings=split.fitted)
        now = lost_commands(data, found.comparison.chosen.fit.model, losses and losses.lost)
        if now is None:  # by a model that is nearer to the robot, what was taken for them is something else
            return WithoutLosses(as_sent, split, None)
        names = found.comparison.chosen.names
        if losses is not None and (names == before or _are_same(losses, now)):
            break
        losses, before = now, names
        progress(
            f"{now.record.share:.1%} of the commands were lost; the effects are searched again by those that acted"
        )
        try:
            found = search([_with(recording, lost) for recording, lost in zip(split.fitted, now.lost, strict=True)])
        except (DataError, ArithmeticError, ValueError) as error:
            progress(f"WARNING: that ended with an error ({error}); what was found by the commands as sent stands")
            return WithoutLosses(as_sent, split, None)
    if losses is None or found.comparison is None:
        return WithoutLosses(as_sent, split, None)
    fitted = tuple(_with(recording, lost) for recording, lost in zip(split.fitted, losses.lost, strict=True))
    return WithoutLosses(found, Split(fitted, _kept_back(found.comparison, split, losses), *split[2:]), losses.record)


def _are_same(one: LostFound, other: LostFound) -> bool:
    """Whether the same commands were lost."""
    return all(np.array_equal(a, b) for a, b in zip(one.lost, other.lost, strict=True))


def _kept_back(comparison: ModelComparison, split: Split, losses: LostFound) -> tuple[Recording, ...]:
    """What was kept back, with the commands that acted, as the model that was found tells them."""
    model = comparison.chosen.fit.model
    begun = [np.zeros(len(recording), dtype=bool) for recording in split.kept_back]
    free = [np.ones(len(recording), dtype=bool) for recording in split.kept_back]
    if split.are_ends:  # they begin with what was fitted, of which it is known
        for whole, may_change, first in zip(begun, free, losses.lost, strict=True):
            whole[: len(first)], may_change[: len(first)] = first, False
    else:
        model = model._replace(offsets=(), balanced=0)
    lost = lost_by(losses.mixture, replace(comparison.data, recordings=split.kept_back), model, begun, free)
    return tuple(_with(recording, those) for recording, those in zip(split.kept_back, lost, strict=True))


def _with(recording: Recording, lost: Mask) -> Recording:
    """The recording with the commands that acted."""
    return recording.commanded(lambda sent: acting(sent, lost))
