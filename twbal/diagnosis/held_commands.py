"""What prediction errors say of each single command: did it act, or the one before?"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array, Mask
from twbal.sysid.kalman import Filter
from twbal.sysid.model import Data, Model
from twbal.sysid.predictor import predict
from twbal.sysid.recording import Recording

_WINDOW = 15  # control periods in which a command is looked for: later, a filter has taken most of it up
_SPACING = 40  # control periods between commands that are changed together


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


def acting(sent: Array, lost: Mask) -> Array:
    """The commands that act (T,) where those that are `lost` (T,) leave the one before."""
    kept = np.where(lost, 0, np.arange(len(sent)))
    return sent[np.maximum.accumulate(kept)]


def held_scores(data: Data, model: Model, kalman: Filter, number: int, lost: Mask) -> HeldScores:
    """What the errors of a recording say of each of its commands, given what is taken to be lost of the others.

    Each command is changed in turn, from acting to lost or back, and the recording is predicted anew; commands that lie
    `_SPACING` apart are changed together. So dead zones, delays and all else that the model has are in the answer.

    Args:
        data: recordings, with the commands that were sent.
        model: predicts them.
        kalman: its filter.
        number: of the recording.
        lost: (T,) which commands are taken to be lost.
    """
    recording = data.recordings[number]
    sent, count = recording.commands, len(recording)
    sizes, scores = np.zeros(count), np.zeros(count)
    before = _decorrelated(data, model, kalman, number, acting(sent, lost))
    for first in range(1, min(_SPACING + 1, count)):
        changed = np.arange(first, count, _SPACING)
        other = lost.copy()
        other[changed] ^= True
        after = _decorrelated(data, model, kalman, number, acting(sent, other))
        for t in changed:
            window = slice(t + 1, t + 1 + _WINDOW)
            acted, held = (after, before) if lost[t] else (before, after)
            earlier = acted[t] - held[t]  # is left of the command before that was changed, and fades slowly
            change = (acted[window] - held[window] - earlier).ravel()
            size = float(np.linalg.norm(change))
            if size > 0.0:
                sizes[t], scores[t] = size, float(acted[window].ravel() @ change) / size
    return HeldScores(sizes, scores)


def _decorrelated(data: Data, model: Model, kalman: Filter, number: int, commands: Array) -> Array:
    """Prediction errors (T + 1, 4) with other commands, decorrelated and in standard deviations; 0 where none count."""
    recording: Recording = replace(data.recordings[number], commands=commands)
    lead = data.lead - model.angle_lead
    errors = predict(model.twin_for(number), recording, data.substeps, lead, kalman).errors
    errors[:, ~data.sensed] = 0.0
    errors[~recording.usable] = 0.0
    last = len(kalman.whiteners) - 1
    white: Array = errors @ kalman.whiteners[last].T
    for n in range(1, min(last, len(errors))):
        white[n] = kalman.whiteners[n] @ errors[n]
    return white
