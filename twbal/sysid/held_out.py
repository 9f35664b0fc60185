"""Data that nothing is fitted to."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from twbal.sysid.recording import Recording

_WHOLE = 4  # recordings, from which on whole ones are kept back


class Split(NamedTuple):
    """Recordings, parted.

    Attributes:
        fitted: that models are fitted to.
        kept_back: that they are not, as far as their instants count (`Recording.usable`).
        names: of what was kept back.
        are_ends: whether what was kept back are the ends of the very recordings that are fitted, in the same order.
            Then they begin with what was fitted, which does not count there: a torque that changes with time, place or
            charge goes on from where it was.
    """

    fitted: tuple[Recording, ...]
    kept_back: tuple[Recording, ...]
    names: tuple[str, ...]
    are_ends: bool


def held_out(recordings: Sequence[Recording], share: float) -> Split:
    """Keep about a share of the recordings back.

    Of four and more, whole ones are kept back, spread evenly, and no fewer than one; of fewer, the end of each, which
    has that share of the instants that count.
    """
    if len(recordings) >= _WHOLE:
        every = min(max(2, round(1 / share)), len(recordings))
        back = [recording for i, recording in enumerate(recordings) if i % every == every - 1]
        fitted = [recording for recording in recordings if recording not in back]
        return Split(tuple(fitted), tuple(back), tuple(recording.name for recording in back), are_ends=False)
    parted = [_cut(recording, recording.instants_until(1 - share)) for recording in recordings]
    first, last = zip(*parted, strict=True)
    return Split(first, last, tuple(recording.name for recording in last), are_ends=True)


def _cut(recording: Recording, at: int) -> tuple[Recording, Recording]:
    """A recording before an instant, and all of it, of which only what comes after counts."""
    times = f"{at * recording.period:.1f}-{len(recording) * recording.period:.1f} s"
    is_end = np.arange(len(recording) + 1) >= at
    last = replace(recording, usable=recording.usable & is_end, name=f"{recording.name}, {times}")
    return recording.part(0, at), last
