"""The shape of a drawn function in words: what can be measured of it, and no name."""

import numpy as np

from twbal.core.gaussian import Array

_MOST = 0.9  # share of what a feature must hold
_STRAIGHT = 0.98  # share of the variance that a straight line explains, from which on it is one
_FLAT = 0.15  # of the steepest slope, below which a curve is flat
_WIDE = 0.3  # share of the range that must be flat for a threshold
_POWERS = np.arange(1.0, 4.01, 0.25)
_REACH = 0.6  # share of the range about zero that must be covered on both sides to speak of odd or even


def shape_of(grid: Array, mean: Array, is_periodic: bool) -> str:
    """A function's shape as a phrase.

    Args:
        grid: (n,) values of the variable.
        mean: (n,) of the function.
        is_periodic: whether the variable counts modulo a turn.
    """
    if is_periodic:
        return _waves(mean)
    said = [_course(grid, mean)]
    line = np.polynomial.Polynomial.fit(grid, mean, 1)(grid)
    if np.sum((mean - line) ** 2) <= (1.0 - _STRAIGHT) * np.sum((mean - mean.mean()) ** 2):
        return f"{said[0]}, nearly along a straight line"
    said += [*_parity(grid, mean), *_flat(grid, mean)]
    return ", ".join(said)


def _waves(mean: Array) -> str:
    """Which waves of a turn hold most of the power."""
    power = np.abs(np.fft.rfft(mean[:-1] - mean[:-1].mean())) ** 2
    first = int(np.argmax(power))
    share = power[first] / max(float(power.sum()), 1e-300)
    waves = f"{first} wave{'' if first == 1 else 's'} in a turn"
    return f"{waves}, which hold{'s' if first == 1 else ''} {share:.0%} of its variation"


def _course(grid: Array, mean: Array) -> str:
    """Whether it rises or falls, but for a tenth of its changes, or where it is highest and lowest."""
    up = float(np.clip(np.diff(mean), 0.0, None).sum())
    down = float(-np.clip(np.diff(mean), None, 0.0).sum())
    if up >= _MOST * (up + down):
        return "it rises throughout"
    if down >= _MOST * (up + down):
        return "it falls throughout"
    turns = int(np.argmax(mean)), int(np.argmin(mean))
    inner = [place for place in turns if 0 < place < len(grid) - 1]
    kind = {turns[0]: "highest", turns[1]: "lowest"}
    return " and ".join(f"it is {kind[place]} at {grid[place]:.2g}" for place in inner) or "it rises and falls"


def _parity(grid: Array, mean: Array) -> list[str]:
    """Whether it is odd or even about zero, and by which power of the variable it grows."""
    reach = min(-grid[0], grid[-1])
    if reach < _REACH * max(-grid[0], grid[-1]):
        return []
    x = np.linspace(0.0, reach, 41)[1:]
    forth, back = np.interp(x, grid, mean), np.interp(-x, grid, mean)
    odd, even = 0.5 * (forth - back), 0.5 * (forth + back)
    even = even - np.interp(0.0, grid, mean)
    powers = float(np.sum(odd**2)), float(np.sum(even**2))
    if max(powers) < _MOST * sum(powers):
        return []
    part, said = (
        (odd, "with the opposite sign on either side of zero")
        if powers[0] > powers[1]
        else (even, "alike on either side of zero")
    )
    power = _power(x, part)
    if power == 0.0:
        return [said, "of one size on each"]
    return [said, f"growing about as the power {power:.2g} of the variable"]


def _power(x: Array, part: Array) -> float:
    """The power of x that fits best."""
    errors = [np.sum((part - (part @ x**p) / (x**p @ x**p) * x**p) ** 2) for p in (0.0, *_POWERS)]
    return float((0.0, *_POWERS)[int(np.argmin(errors))])


def _flat(grid: Array, mean: Array) -> list[str]:
    """The range within which it hardly changes, where that is a good part of all."""
    slopes = np.abs(np.gradient(mean, grid))
    flat = slopes < _FLAT * slopes.max()
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flat.astype(int), [0]])))
    runs = [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    if not runs:
        return []
    begin, end = max(runs, key=lambda run: run[1] - run[0])
    if grid[end] - grid[begin] < _WIDE * (grid[-1] - grid[0]):
        return []
    return [f"nearly flat from {grid[begin]:.2g} to {grid[end]:.2g}"]
