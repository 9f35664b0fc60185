"""Dry friction, as an impulse within bounds that acts after the rest of a physics step."""

from math import exp

from twbal.core.compiled import kernel, rarely
from twbal.planar.constants import Constants

SWEEPS = 50
"""Most rounds over the impulses, where several act at once; as many as a physics engine takes."""

_MANY = 10  # rounds after which extrapolations may go to and fro

SETTLED = 1e-12
"""Share of the impulses; a round that changes them by less is the last.

Rounds seldom come to the very same digits twice: they end in changes of the last digit to and fro.
"""


@kernel(is_inlined=True)
def wheel_bound(k: Constants, rate: float) -> float:
    """Largest dry friction in the joint of one wheel at its rate relative to the body [rad/s], [N·m]."""
    if not rarely(k.dry.breakaway > 0.0):
        return k.dry.coulomb
    share = rate / k.dry.stribeck_rate
    return k.dry.coulomb + k.dry.breakaway * exp(-share * share)


@kernel(is_inlined=True)
def joint_bound(k: Constants, relative: float, apart: float) -> float:
    """Largest dry friction of both joints together [N·m].

    Args:
        k: constants of the planar model.
        relative: mean rate of the wheels relative to the body [rad/s].
        apart: by which one wheel is faster than that and the other slower [rad/s].
    """
    return wheel_bound(k, relative - apart) + wheel_bound(k, relative + apart)


@kernel(is_inlined=True)
def cut(value: float, bound: float) -> float:
    """`value` within ±`bound`."""
    return min(max(value, -bound), bound)


@kernel(is_inlined=True)
def is_settled(first: float, second: float, third: float, before: tuple[float, float, float]) -> bool:
    """Whether a round has changed the three impulses of a step so little that further rounds need not be taken.

    Impulses that are no numbers count as settled: the prediction has diverged.
    """
    changed = abs(first - before[0]) + abs(second - before[1]) + abs(third - before[2])
    return not changed > SETTLED * (abs(first) + abs(second) + abs(third))


@kernel(is_inlined=True)
def extrapolation_factor(changed: tuple[float, float], last: tuple[float, float], rounds: int) -> float:
    """By what multiple of a round's way from the outcome of the round before the limit of all rounds lies ahead.

    (D. G. Anderson: Iterative procedures for nonlinear integral equations, Journal of the ACM 12 (4), 1965, with one
    round before; for one impulse it is the secant method.)

    Args:
        changed: what the round changed in two impulses, of one unit.
        last: what the round before changed in them.
        rounds: how many were before. After many, half of the multiple: impulses may go to and fro between their bounds
            and values within these.
    """
    first, second = changed[0] - last[0], changed[1] - last[1]
    squared = first * first + second * second
    if rounds == 0 or squared == 0.0:
        return 0.0
    return -(changed[0] * first + changed[1] * second) / squared * (1.0 if rounds < _MANY else 0.5)


@kernel(is_inlined=True)
def rub(so_far: float, rate: float, inertia: float, bound: float, apart: float) -> float:
    """Change of the dry friction's impulse on both wheels.

    Alone, the impulse would bring a rate beyond what the wheels are apart back to that, where one of them stands still.

    Args:
        so_far: impulse of the rounds before.
        rate: mean of the wheels, with that impulse.
        inertia: against which an impulse changes that rate [kg·m²].
        bound: of the impulse.
        apart: as of `joint_bound`.
    """
    wanted = cut(rate - so_far / inertia, apart) if apart > 0.0 else 0.0
    return cut(so_far - (rate - wanted) * inertia, bound) - so_far
