"""What prediction errors say of each single command: did it act, or the one before?"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array, Mask
from twbal.sysid.kalman import Filter
from twbal.sysid.model import Data, Model

_WINDOW = 15  # control periods in which a command is looked for: later, a filter has taken most of it up
_SPACING = 40  # control periods between commands that are changed together
_TOGETHER = 5  # commands before a large error, of which any may be lost
_LARGE = 40.0  # square of an error in standard deviations, of four channels together, that noise alone does not make
_DEGREES = 10.0  # of freedom of the errors' Student t, by which decisions are compared
_ROUNDS = 12  # over the large errors
_GAIN = 6.0  # of -2 log posterior, by which several changes must be better


class HeldScores(NamedTuple):
    """Of each of the T commands of a recording.

    Attributes:
        sizes: (T,) by how much the decorrelated prediction errors would change if the command had been lost, in
            standard deviations of one of them; 0 where nothing would.
        scores: (T,) the errors along that change. In units of such a standard deviation they scatter about `sizes` for
            a lost command, and about 0 for one that acted.
    """

    sizes: Array
    scores: Array


class SentCommands(NamedTuple):
    """A recording with the commands that were sent, and the model that predicts it.

    Attributes:
        data: one recording.
        model: predicts it.
        kalman: its filter.
    """

    data: Data
    model: Model
    kalman: Filter

    def errors(self, lost: Mask) -> Array:
        """Prediction errors (T + 1, 4), decorrelated and in standard deviations, where these commands (T,) are lost.

        They are 0 at instants that do not count, and of channels that no sensor measured.
        """
        (recording,) = self.data.recordings
        changed = replace(self.data, recordings=[recording.commanded(lambda sent: acting(sent, lost))])
        (errors,) = changed.errors(self.model, self.kalman)
        errors[~recording.usable] = 0.0
        whiteners, last = self.kalman.whiteners, len(self.kalman.whiteners) - 1
        white: Array = errors @ whiteners[last].T
        for n in range(1, min(last, len(errors))):
            white[n] = whiteners[n] @ errors[n]
        return white


def sent_commands(data: Data, model: Model) -> list[SentCommands]:
    """Each recording by itself, with the model that is one of all."""
    kalman, model = data.filter(model), model.apart
    offsets = [model.offsets[k : k + 1] for k in range(len(data.recordings))]
    return [
        SentCommands(replace(data, recordings=[recording]), model._replace(offsets=offset), kalman)
        for recording, offset in zip(data.recordings, offsets, strict=True)
    ]


def acting(sent: Array, lost: Mask) -> Array:
    """The commands that act (T,) where those that are `lost` (T,) leave the one before."""
    kept = np.where(lost, 0, np.arange(len(sent)))
    return sent[np.maximum.accumulate(kept)]


def held_scores(sent: SentCommands, lost: Mask) -> HeldScores:
    """What the errors of a recording say of each of its commands, given what is taken to be lost of the others.

    Each command is changed in turn, from acting to lost or back, and the recording is predicted anew; commands that lie
    `_SPACING` apart are changed together. So dead zones, delays and all else that the model has are in the answer.

    Args:
        sent: the commands.
        lost: (T,) which of them are taken to be lost.
    """
    count, usable = len(lost), sent.data.recordings[0].usable
    sizes, scores = np.zeros(count), np.zeros(count)
    before = sent.errors(lost)
    for first in range(1, min(_SPACING + 1, count)):
        changed = np.arange(first, count, _SPACING)
        other = lost.copy()
        other[changed] ^= True
        after = sent.errors(other)
        for t in changed:
            window = slice(t + 1, t + 1 + _WINDOW)
            acted, held = (after, before) if lost[t] else (before, after)
            earlier = acted[t] - held[t]  # is left of the command before that was changed, and fades slowly
            change = (acted[window] - held[window] - earlier * usable[window, None]).ravel()
            size = float(np.linalg.norm(change))
            if size > 0.0:
                sizes[t], scores[t] = size, float(acted[window].ravel() @ change) / size
    return HeldScores(sizes, scores)


def with_several_lost(sent: SentCommands, lost: Mask, may_change: Mask, log_odds: float) -> Mask:
    """Which commands are lost, where changes of several neighbours at once are tried before large errors.

    Of two neighbours of which both or the other one were lost, no single change may be better. Any of the commands
    before a large error may have been lost; of all their combinations the likeliest is taken.

    Args:
        sent: the commands.
        lost: (T,) which are taken to be lost.
        may_change: (T,) of which of them that is asked.
        log_odds: of any one to be lost, before its errors are seen.
    """
    tried = np.zeros(len(lost) + 1, dtype=bool)
    white = sent.errors(lost)
    for _ in range(_ROUNDS):
        places = _apart(np.flatnonzero((_squares(white) > _LARGE) & ~tried).tolist())
        if not places:
            break
        losses = _losses(white)
        tried[places] = True
        choices, costs = list[Mask](), list[list[float]]()
        for bits in product((False, True), repeat=_TOGETHER):
            other = lost.copy()
            for t in places:
                before = slice(max(1, t - _TOGETHER), t)
                other[before] = np.where(may_change[before], bits[-(before.stop - before.start) :], lost[before])
            choices.append(other)
            whole = _losses(sent.errors(other))
            costs.append([_near(t, whole, other, log_odds) for t in places])
        best = lost.copy()
        for place, (t, number) in enumerate(zip(places, np.argmin(costs, axis=0), strict=True)):
            if costs[number][place] < _near(t, losses, lost, log_odds) - _GAIN:
                best[t - _TOGETHER : t] = choices[number][t - _TOGETHER : t]
                tried[t : t + _SPACING] = False
        if not np.array_equal(best, lost):
            lost, white = best, sent.errors(best)
    return lost


def _apart(instants: Sequence[int]) -> list[int]:
    """The first of them, and each that lies `_SPACING` behind the last one that was taken."""
    found: list[int] = []
    for t in instants:
        if t >= _TOGETHER and (not found or t - found[-1] >= _SPACING):
            found.append(t)
    return found


def _squares(white: Array) -> Array:
    found: Array = np.sum(white**2, axis=1)
    return found


def _losses(white: Array) -> Array:
    """-2 log density of the errors of each instant (T + 1,) by a Student t, but for a constant."""
    found: Array = (_DEGREES + 4.0) * np.log1p(_squares(white) / _DEGREES)
    return found


def _near(t: int, losses: Array, lost: Mask, log_odds: float) -> float:
    """-2 log posterior of what is lost before an instant, by the errors that follow."""
    begin = max(t - _TOGETHER, 0)
    return float(np.sum(losses[begin + 1 : t + _WINDOW]) - 2.0 * log_odds * np.sum(lost[begin:t]))
