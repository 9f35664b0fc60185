"""Tyres that creep before they slide; plain enough for kernels, too (`twbal.core.compiled`)."""

from math import pow, sqrt


def traction_impulse(slip: float, mobility: float, grip: float, creep: float) -> float:
    """Traction of tyres in a physics step, by the slip that comes of it [N·s].

    Tyres that creep are those of the brush model: below the speed v_c at which they slide, a slip at the speed v makes
    a traction of 1 - (1 - v / v_c)³ of the bound (H. B. Pacejka: Tire and Vehicle Dynamics, 3rd ed., 2012).

    Args:
        slip: that there would be at the step's end without traction [m/s].
        mobility: what a traction changes it by [1/kg].
        grip: the bound [N·s].
        creep: speed of slip at which the tyres slide [m/s].
    """
    most = mobility * grip
    if creep == 0.0 or most == 0.0 or abs(slip) >= most + creep:
        return min(max(-slip / mobility, -grip), grip)
    # With y = 1 - v / v_c: most y³ + creep y = most + creep - |slip|, a cubic with one real root (Cardano).
    p, q = creep / most, (most + creep - abs(slip)) / most
    share = sqrt(p / 3.0)
    half = 0.5 * q / share**3
    root = pow(half + sqrt(half * half + 1.0), 1.0 / 3.0)
    y = share * (root - 1.0 / root)
    traction = grip * (1.0 - y * y * y)
    return -traction if slip > 0.0 else traction
