r"""One physics step of the planar model.

The equations of `dynamics` with what effects add. On ground that rises by σ ahead, turning at the yaw rate ψ̇ (a known
input), with the torque τ between wheels and body, the force F and the torque τ_g on the wheels from outside,

    a φ̈ + b cos(α + σ) θ̈ - b sin(α + σ) θ̇² = τ + τ_g + r F - M g r sin σ + b sin(α + σ) ψ̇²
    b cos(α + σ) φ̈ + c θ̈ - d sin α
        = -τ + ψ̇² (m l² sin(α + σ) cos(α + σ) + (I_xx - I_zz) sin(θ + σ) cos(θ + σ)),

M being the mass of all. Rates go by the accelerations at the step's start, then angles by the new rates (semi-implicit
Euler). Dry frictions and the backlash are impulses within bounds, which act after the rest of the step: each brings its
relative rate to where it wants it, or goes to its bound. Dry friction that grows over an angle is that of the angle at
the step's end (`presliding`).

A robot that turns has its slope and its wheels elsewhere: ground that rose by σ_0 at the start rises by σ_0 cos ψ at
the heading ψ. As the robot stands on that ground, its axle tips while it turns, and θ and φ, which count from the
vertical, grow by σ_0 sin ψ ψ̇ beside θ̇, which a gyro measures about the axle. The wheels turn by e = ψ̇ t / 2 r faster
and slower than their mean, t being the track. Dry friction at the two of them then cancels as long as the mean rate is
within ±e, and their cogging is out of step.

Where a part J' of the wheels' inertia is of rotors that turn relative to the body, b cos loses J' and c gains it. (On
tyres that slip these rotors turn with the wheels in space.)

Where a part of the body swings, of the mass m_s at the height h on the line to the centre of mass, it is y away from
where a rigid frame would hold it. It takes no part in motion across the body, so that a loses m_s r² cos²(α + σ), b cos
loses m_s r h cos(α + σ), and c loses m_s h². With the stiffness k and the damping D of its spring,

    S = k y + D ẏ - m_s (g sin α + h ψ̇² sin(α + σ) cos(α + σ)),   ÿ = -S / m_s + y θ̇² - cos(α + σ) v̇ - h θ̈,

v being the axle's speed, and the rest of the body gets the forces r cos(α + σ) S + 2 m_s r sin(α + σ) θ̇ ẏ on φ and
h S + m_s y (g cos α - h θ̇² - 2 θ̇ ẏ) on θ. What is smaller still (m_s y θ̈ and the like) is left out.

With a backlash the rotors, of inertia J (both), turn by an angle ρ of their own: J ρ̈ = τ - (contact), and the wheels
have a - J in place of a. The contact is plastic and keeps |ρ - φ| within half of the gap.
"""

from twbal.core.compiled import kernel, rarely
from twbal.core.robot_model import UNBOUNDED
from twbal.planar.constants import Constants
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_state import PlanarState, Turning
from twbal.planar.rolling import roll
from twbal.planar.slipping import slide


@kernel(is_inlined=True)
def step(
    p: PlanarParameters, k: Constants, s: PlanarState, torque: float, time: float, turning: Turning
) -> PlanarState:
    """One physics step, as of `roll` or `slide`."""
    if rarely(k.grip < UNBOUNDED):
        return slide(p, k, s, torque, time, turning)
    return roll(p, k, s, torque, time, turning)
