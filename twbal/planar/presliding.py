"""Dry friction that grows over an angle: gears and tyres bend before they slide."""

from typing import NamedTuple

from twbal.core.compiled import kernel, rarely
from twbal.planar.constants import Constants
from twbal.planar.dry_friction import cut, rub, wheel_bound
from twbal.planar.planar_state import PlanarState, Turning


class Bristles(NamedTuple):
    """Dry friction of both wheels at the start of a physics step, by the bristles that stand for it in such models.

    Attributes:
        left, right: impulses that it would have if the bristles stayed as they are [N·m·s].
        left_stiffness, right_stiffness: by which these change with the wheels' rates [kg·m²].
        left_bound, right_bound: of these impulses at the wheels' rates [N·m·s].
        apart: by which the right wheel is faster than the mean, and the left one slower [rad/s].
    """

    left: float
    right: float
    left_stiffness: float
    right_stiffness: float
    left_bound: float
    right_bound: float
    apart: float


class Contact(NamedTuple):
    """Where dry friction acts.

    Attributes:
        rate: mean of the wheels there at the end of the step, without friction [rad/s].
        inertia: against which an impulse on both changes that rate [kg·m²].
    """

    rate: float
    inertia: float


RIGID = Bristles(0.0, 0.0, 0.0, 0.0, -1.0, -1.0, 0.0)
"""Of dry friction that holds at once: it has no bristles."""


@kernel(is_inlined=True)
def _stiffness(k: Constants, impulse: float, bound: float, at_rest: float, rate: float) -> float:
    """By which the impulse of one wheel's friction changes with its rate [kg·m²]; arguments as of `_bristles`."""
    if bound <= 0.0:
        return 0.0
    return k.step * at_rest / k.dry.presliding * (1.0 + impulse / bound if rate > 0.0 else 1.0 - impulse / bound)


@kernel(is_inlined=True)
def _bristles(
    k: Constants, torques: tuple[float, float], at: Contact, bounds: tuple[float, float], at_rest: float, apart: float
) -> Bristles:
    """Dry friction at the start of a step.

    Over an angle x of the wheel its torque τ changes by dτ/dx = -(S / s) (1 + (τ / F) sgn ẋ), F being its bound at the
    rate of the wheel, S that at rest, and s the angle of the presliding. (Where F is S: P. R. Dahl: Solid friction
    damping of mechanical vibrations, AIAA Journal 14 (12), 1976. Else: C. Canudas de Wit, H. Olsson, K. J. Åström,
    P. Lischinsky: A new model for control of systems with friction, IEEE Trans. Automatic Control 40 (3), 1995.)

    Args:
        k: constants of the planar model.
        torques: of the friction of the left wheel and the right one in the step before [N·m].
        at: where it acts.
        bounds: of the impulses on the left wheel and the right one [N·m·s].
        at_rest: bound of the impulse on each at rest [N·m·s].
        apart: as of `Bristles`.
    """
    left, right = cut(k.step * torques[0], bounds[0]), cut(k.step * torques[1], bounds[1])
    mean = at.rate + (left + right) / at.inertia
    return Bristles(
        left,
        right,
        _stiffness(k, left, bounds[0], at_rest, mean - apart),
        _stiffness(k, right, bounds[1], at_rest, mean + apart),
        bounds[0],
        bounds[1],
        apart,
    )


@kernel(is_inlined=True)
def frictions(
    k: Constants, s: PlanarState, joint: Contact, ground: Contact, turning: Turning
) -> tuple[Bristles, Bristles]:
    """The dry friction of the joints and of the ground at the start of a step that ends as `joint` and `ground` say."""
    if not rarely(k.dry.presliding > 0.0):
        return RIGID, RIGID
    relative, apart = s.wheel_speed - s.tilt_rate, k.apart * turning.rate
    bounds = k.step * wheel_bound(k, relative - apart), k.step * wheel_bound(k, relative + apart)
    rolling = k.step * k.dry.rolling
    return (
        _bristles(k, (s.left_joint, s.right_joint), joint, bounds, k.step * wheel_bound(k, 0.0), apart),
        _bristles(k, (s.left_ground, s.right_ground), ground, (rolling, rolling), rolling, apart),
    )


@kernel(is_inlined=True)
def _impulses(b: Bristles, rate: float) -> tuple[float, float]:
    """Impulses of the friction on the left wheel and the right one by their mean rate at a step's end [N·m·s]."""
    left = cut(b.left - b.left_stiffness * (rate - b.apart), b.left_bound)
    return left, cut(b.right - b.right_stiffness * (rate + b.apart), b.right_bound)


@kernel(is_inlined=True)
def rub_or_bend(so_far: float, rate: float, inertia: float, bound: float, apart: float, b: Bristles) -> float:
    """Change of the dry friction's impulse on both wheels; arguments as of `dry_friction.rub`, and its bristles."""
    if not rarely(b.left_bound >= 0.0):
        return rub(so_far, rate, inertia, bound, apart)
    grown = b.left + b.right + (b.left_stiffness - b.right_stiffness) * b.apart
    stiffness = b.left_stiffness + b.right_stiffness
    left, right = _impulses(b, (inertia * rate - so_far + grown) / (inertia + stiffness))
    return left + right - so_far


@kernel(is_inlined=True)
def torques(k: Constants, b: Bristles, rate: float) -> tuple[float, float]:
    """Friction of the left wheel and the right one by their mean rate at a step's end [N·m]; 0 without bristles."""
    if not rarely(b.left_bound >= 0.0):
        return 0.0, 0.0
    left, right = _impulses(b, rate)
    return left / k.step, right / k.step
