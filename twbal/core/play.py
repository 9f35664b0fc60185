"""Play between the motors' rotors and the wheels, as both simulations step it."""

from math import ceil
from typing import NamedTuple

from twbal.core.compiled import kernel

CONTACT_STEP = 0.00025
"""Step in which gears that bend move, at most [s]."""


class Play(NamedTuple):
    """Between rotors and wheels; all 0 where there is none.

    Attributes:
        rotors: J, inertia of both rotors [kg·m²].
        gap: full width, as an angle of the wheel [rad].
        stiffness: of both gears, where rotor and wheel meet [N·m/rad]; 0 where they are rigid.
        damping: of that [N·m·s/rad].
        is_behind_encoder: 1 where the encoders sit on the rotors' side of it, 0 on the wheels'.
    """

    rotors: float
    gap: float
    stiffness: float
    damping: float
    is_behind_encoder: float


@kernel(is_inlined=True)
def engage(play: Play, step: float, ahead: float, before: float, free: float, mobility: float) -> tuple[float, float]:
    """Impulse between rotors and wheels in a step [N·m·s], and how far ahead of the wheels the rotors are at its end.

    Rigid gears keep the rotors within the gap. Gears that bend are a spring and a damper that push and never pull. They
    ring in a few milliseconds, so a step has parts for them, of `CONTACT_STEP` at most. In each part the damper acts as
    at its end. The spring acts as it is half through the part; where it rings in less than a few parts, as at their
    end, which is stable and leads to the plastic impact of rigid gears. A part in which the spring acts as it will be
    damps by itself, like a damper of the stiffness times the time until then. The damper is taken to be weaker by that,
    but no less than none.

    Args:
        play: between the two.
        step: physics step [s].
        ahead: of the wheels are the rotors, at the step's start [rad].
        before: by how much faster than the wheels they are there [rad/s].
        free: the same at the step's end, without the impulse; it changes evenly in between.
        mobility: rate that the wheels gain per impulse [1/(kg·m²)].
    """
    apart_by, half = mobility + 1.0 / play.rotors, 0.5 * play.gap  # what an impulse adds to their difference in rate
    if play.stiffness == 0.0:
        wanted = min(max(ahead + step * free, -half), half)
        return (free - (wanted - ahead) / step) / apart_by, wanted
    parts = max(ceil(step / CONTACT_STEP - 1e-9), 1)
    h, gained, faster, impulse = step / parts, (free - before) / parts, before, 0.0
    turned = h * h * play.stiffness / play.rotors  # square of the phase by which they ring in a part
    until = h * (1.0 - 2.0 / (4.0 + turned))
    damping = max(play.damping - until * play.stiffness, 0.0)
    yielding = 1.0 + h * apart_by * (until * play.stiffness + damping)
    for _ in range(parts):
        faster += gained
        beyond = ahead + until * faster
        beyond -= min(max(beyond, -half), half)
        push = h * (play.stiffness * beyond + damping * faster) / yielding
        if push * beyond > 0.0:
            impulse += push
            faster -= apart_by * push
        ahead += h * faster
    return impulse, ahead
