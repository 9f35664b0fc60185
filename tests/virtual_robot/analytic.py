"""The robot by hand, from Lagrange's equations alone; nothing of it is twbal's.

Coordinates: x of the axle along level ground, tilt θ. A wheel turns by x / r over ground, so that its hinge turns by
q = x / r - θ, which is what a torque u of both motors works on. A rotor J turns with q, a wheel I with x / r:

Where the centre of mass lies in front of the body's z axis, θ is its own tilt.

T = ½ (m + 2 m_w) ẋ² + I (ẋ/r)² + J q̇² + ½ (I_b + m l²) θ̇² + m l ẋ θ̇ cos θ,   V = m g l cos θ
a ẍ + b θ̈ = u / r,   b ẍ + c θ̈ - m g l θ = -u   for small θ, with
a = m + 2 m_w + 2 (I + J) / r²,   b = m l - 2 J / r,   c = I_b + m l² + 2 J.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm, solve_discrete_are

G = 9.81


@dataclass(frozen=True)
class Linear:
    """Coefficients of the linearised equations."""

    a: float
    b: float
    c: float
    mgl: float
    radius: float

    @property
    def pole(self):
        """Rate at which an uncontrolled robot falls [1/s]."""
        return np.sqrt(self.mgl * self.a / (self.a * self.c - self.b**2))

    def gain(self, period, limit, position=False):
        """LQR of [tilt, tilt rate, speed], or with the place as a fourth."""
        inertia = np.linalg.inv(np.array([[self.a, self.b], [self.b, self.c]]))
        by_tilt, by_torque = inertia @ [0.0, self.mgl], inertia @ [1.0 / self.radius, -1.0]
        A = np.zeros((4, 4))
        A[0, 1], A[3, 2], A[1, 0], A[2, 0] = 1.0, 1.0, by_tilt[1], by_tilt[0]
        B = np.array([[0.0], [by_torque[1]], [by_torque[0]], [0.0]])
        n = 4 if position else 3
        block = np.zeros((n + 1, n + 1))
        block[:n, :n], block[:n, n:] = A[:n, :n], B[:n]
        sampled = expm(block * period)
        A, B = sampled[:n, :n], sampled[:n, n:]
        reach = 10 * self.radius
        Q = np.diag(np.array([0.25, 2.5, reach * self.pole / 3, reach][:n]) ** -2.0)
        R = np.array([[limit**-2.0]])
        P = solve_discrete_are(A, B, Q, R)
        return np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)[0]


def linear(truth):
    """Of a robot."""
    body = truth.body
    m, length, r, rotor = body.mass, body.com_height, np.mean(body.wheel_radius), body.rotor_inertia
    return Linear(
        a=m + 2 * body.wheel_mass + 2 * (body.wheel_inertia + rotor) / r**2,
        b=m * length - 2 * rotor / r,
        c=body.inertia[1] + m * length**2 + 2 * rotor,
        mgl=m * G * length,
        radius=r,
    )


def energy(truth, tilt, tilt_rate, speed):
    """Kinetic and potential energy [J], for any tilt."""
    k, body = linear(truth), truth.body
    across = body.mass * body.com_height * np.cos(tilt + body.com_offset) - 2 * body.rotor_inertia / k.radius
    kinetic = 0.5 * k.a * speed**2 + 0.5 * k.c * tilt_rate**2 + across * speed * tilt_rate
    return kinetic + k.mgl * np.cos(tilt + body.com_offset)
