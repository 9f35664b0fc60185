"""Names for factors by which a quantity is off: mistaken units, left-out scales."""

from math import log, pi

_KNOWN = {
    180 / pi: "degrees are taken for radians, or the other way round",
    2 * pi: "turns are taken for radians, or the other way round",
    60 / (2 * pi): "turns a minute are taken for rad/s, or the other way round",
    6.0: "turns a minute are taken for degrees a second, or the other way round",
    1000.0: "a thousandth (ms, mm, mNm) is taken for the whole, or the other way round",
    100.0: "a hundredth (%, cm, Ncm) is taken for the whole, or the other way round",
    2.0: "a sum is taken for a mean, or the other way round",
}
_EDGES = 2.0, 4.0
OF_EDGES = "encoders count 1, 2 or 4 edges a line"
"""Why wheels may be off by a factor of 2 or 4."""
_NEAR = 0.2  # of the logarithm


def is_of_edges(factor: float) -> bool:
    """Whether a factor, larger or smaller than 1, is about that between numbers of an encoder's edges that count."""
    return factor > 0.0 and min(abs(abs(log(factor)) - log(edges)) for edges in _EDGES) < _NEAR


def guessed_reason(factor: float, near: float = _NEAR, is_of_wheels: bool = False) -> str:
    """What makes a quantity wrong by a factor, in brackets; "" where nothing known does.

    Args:
        factor: one that is not positive has no reason.
        near: largest distance of its logarithm from that of a known one.
        is_of_wheels: whether the scale of an encoder may be off.
    """
    if factor <= 0.0:
        return ""
    size = abs(log(factor))
    edges = dict.fromkeys(_EDGES, f"the scale is that of another number of edges: {OF_EDGES}") if is_of_wheels else {}
    distance, reason = min((abs(size - log(known)), reason) for known, reason in (_KNOWN | edges).items())
    return f" (as if {reason})" if distance < near else ""
