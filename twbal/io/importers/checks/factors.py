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
_NEAR = 0.2  # of the logarithm


def guessed_reason(factor: float, near: float = _NEAR) -> str:
    """What makes a quantity wrong by a factor, in brackets; "" where nothing known does.

    Args:
        factor: one that is not positive has no reason.
        near: largest distance of its logarithm from that of a known one.
    """
    if factor <= 0.0:
        return ""
    size = abs(log(factor))
    distance, reason = min((abs(size - log(known)), reason) for known, reason in _KNOWN.items())
    return f" (as if {reason})" if distance < near else ""
