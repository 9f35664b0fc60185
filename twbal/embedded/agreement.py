"""Whether the header does what the policy does: in value and in gain, over its working range."""

from dataclasses import dataclass

import numpy as np

from twbal.core.gaussian import Array
from twbal.embedded.compiler import CompiledPolicy
from twbal.embedded.laws import rounding_of
from twbal.embedded.working_range import sampled_states
from twbal.policies.saved import SavedPolicy

MAX_GAIN_ERROR = 1e-3
"""Largest difference of a gain, as a share of the largest gain."""
_STEP = 1 / 16  # of a channel's range: step of the central differences, the same in both
_BLOCK = 1000  # states at a time: what is computed of them fits into the cache


@dataclass(frozen=True)
class Agreement:
    """How far the compiled header is from the policy.

    Attributes:
        states: at which both were compared.
        max_error: largest difference of the commands [N·m].
        max_of_bound: the same as a share of what single precision explains at that state; at most 1.
        max_gain_error: largest difference of a gain, by any channel, as a share of the largest gain, where each channel
            counts in units of its working range.
        gain_by_channel: the same for each channel as a share of its own largest gain.
    """

    states: int
    max_error: float
    max_of_bound: float
    max_gain_error: float
    gain_by_channel: dict[str, float]

    @property
    def is_equal(self) -> bool:
        """Whether both are one within rounding, and the gains within their tolerance."""
        return self.max_of_bound <= 1.0 and self.max_gain_error <= MAX_GAIN_ERROR


def agreement(
    compiled: CompiledPolicy, policy: SavedPolicy, widths: Array, count: int, rng: np.random.Generator
) -> Agreement:
    """Compare both at `count` states of the working range.

    Args:
        compiled: the header.
        policy: in double precision.
        widths: of the working range, (D,).
        count: of states.
        rng: that they are drawn from.
    """
    error = share = 0.0
    gain_error, gain = np.zeros(len(widths)), np.zeros(len(widths))
    for begin in range(0, count, _BLOCK):
        states = sampled_states(widths, min(_BLOCK, count - begin), rng)
        expected = rounding_of(policy, states)
        off = _infinite_for_nan(np.abs(compiled.commands(states) - expected.command))
        error, share = max(error, float(off.max())), max(share, float((off / expected.bound).max()))
        for channel, width in enumerate(widths):
            ours, theirs = _differences(compiled, policy, states, channel, _STEP * width)
            gain_error[channel] = max(gain_error[channel], float(_infinite_for_nan(np.abs(ours - theirs)).max()))
            gain[channel] = max(gain[channel], float(np.abs(theirs).max()))
    by_channel = {n: float(e / g) if g else 0.0 for n, e, g in zip(policy.channels, gain_error, gain, strict=True)}
    largest = float(gain.max()) or 1.0
    return Agreement(count, error, share, float(gain_error.max()) / largest, by_channel)


def _infinite_for_nan(errors: Array) -> Array:
    """The same errors; infinite where the header computes no number, which no comparison would see."""
    return np.where(np.isnan(errors), np.inf, errors)


def _differences(
    compiled: CompiledPolicy, policy: SavedPolicy, states: Array, channel: int, step: float
) -> tuple[Array, Array]:
    """Central differences of both over the same states, which single precision holds."""
    above, below = states.copy(), states.copy()
    above[:, channel] = (states[:, channel] + step).astype(np.float32)
    below[:, channel] = (states[:, channel] - step).astype(np.float32)
    theirs = policy.command(above) - policy.command(below)
    ours = compiled.commands(above) - compiled.commands(below)
    return ours, theirs
