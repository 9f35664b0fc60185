"""Write docs/virtual_robot.md, its tables from conf/groups/faults.yaml: `python scripts/virtual_robot.py`."""

import re
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from twbal.cli.settings.link_settings import FAULTS

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "virtual_robot.md"
CONF = ROOT / "conf" / "groups" / "faults.yaml"
CHOICES = ("none", "light", "moderate", "hard")


class Section(NamedTuple):
    """One of the page.

    Attributes:
        title: of it.
        text: equations.
        ranges: settings whose ranges it tabulates, with their symbols.
    """

    title: str
    text: str
    ranges: dict[str, str]


HEAD = """# The virtual robot

`twbal virtual-robot` is a robot in MuJoCo behind a serial port. It stands for the real robot in tests, so it shares
nothing with what learns to drive it: it imports neither the simulation nor the planar model, the effects, the models,
the search or the diagnosis (`tests/test_architecture.py`), and has its own equations. `faults=none`, `light`,
`moderate` or `hard` (the default) chooses the ranges, and the seed draws one robot from them. The same seed is the same
robot, and the same seed and trial give the same rollout, to the byte.

`none` is the data sheet with ideal sensors. `moderate` stays within a quarter of the data sheet, with 5-25 ms from
command to what is seen of it. `hard` draws each value from the lowest or the highest {outer:.0%} of its range.

Torques are those of a robot whose limit is {reference:g} N·m, and scale with the limit of another. The comments of
`conf/groups/faults.yaml` say where the ranges are taken from. This page is written by `scripts/virtual_robot.py`;
`tests/virtual_robot/` checks each equation.
"""

SECTIONS = (
    Section(
        "Body and wheels",
        """A free body (six degrees of freedom) with two hinges on a plane. Wheels meet the ground as spheres of radius
r, which under a level axle is where a thin disc would. Friction of 1 holds them; they slip by less than 1e-3 of their
path. An eccentric wheel turns about an axle that is off its middle by e. The rotor's share ρ of the data sheet's wheel
inertia turns with the hinge, by q, and not over ground: I_w = (1 - ρ) I, J = ρ I. One factor scales all three inertias
of the body, so that it stays a body that there can be. With x along level ground, tilt θ, and a centre of mass that is
off the axis by θ_c, a robot that goes straight obeys

    (m + 2 m_w + 2 I_w / r²) ẍ + m l (θ̈ cos(θ + θ_c) - θ̇² sin(θ + θ_c)) = Σ τ / r - 2 J q̈ / r + F
    m l ẍ cos(θ + θ_c) + (I_b + m l²) θ̈ - m g l sin(θ + θ_c) = -Σ τ + 2 J q̈,    q = x / r - θ
""",
        {
            "body_mass": "m",
            "com_height": "l",
            "com_offset": "θ_c",
            "body_inertia": "I_b",
            "wheel_mass": "m_w",
            "wheel_inertia": "I",
            "rotor_share": "ρ",
            "wheel_radius": "r",
            "radius_difference": "(r_L - r_R) / r",
            "eccentricity": "e / r",
        },
    ),
    Section(
        "From command to motor",
        """The command u is cut at u_max and held for the control period. What acts at time t is what was given at
t - d, with d any time: a physics step in which the command changes takes the mean over its parts. Then, for each motor
(L, R) in this order:

    dead zone    z = max(u/2 - w₊/2, 0) + min(u/2 + w₋/2, 0),   w₊ = w (1 - max(-s, 0)),   w₋ = w (1 - max(s, 0))
    gain         k_L, k_R = k (1 ± δ/2)
    supply       V = 1 - R_i p - c ∫ p dt,   p = (|τ_L| + |τ_R|) / u_max
    lag          T dy/dt = k V z - y
    slew limit   |dτ/dt| ≤ (u_max / 2) / T_s towards y
""",
        {
            "delay": "d",
            "delay_periods": "d",
            "dead_zone": "w",
            "dead_zone_skew": "s",
            "torque_gain": "k",
            "motor_difference": "δ",
            "sag_load": "R_i",
            "sag_use": "c",
            "motor_lag": "T",
            "slew_time": "T_s",
        },
    ),
    Section(
        "From motor to wheel",
        """With the shaft's rate ω relative to the body and its angle φ, the shaft gets

    τ - b ω - f + A sin(n φ + φ_L,R) + ν/2

where b is back-EMF and grease, A cogging with each wheel's own phase, ν a random torque of standard deviation σ_ν,
which is drawn anew for each control period, and f dry friction by the LuGre model (Canudas de Wit et al., 1995) with
Stribeck's curve:

    f = σ₀ z + σ₁ dz/dt,   dz/dt = ω - σ₀ |ω| z / g(ω),   g(ω) = f_c + (f_s - f_c) exp(-(ω / ω_s)²),   σ₀ = f_s / z_s

σ₁ damps the wheel's inertia on its bristles by 0.3 of critical. With play γ the rotor J is a body of its own: teeth
push with stiffness K and damping D where the rotor is more than γ/2 ahead or behind, and never pull. K twists by 0.5°
under u_max / 2, D damps the rotor by half of critical. The encoder then sits on the motor, before the play, or on the
wheel. Without play the rotor is an inertia of the hinge.
""",
        {
            "viscous_friction": "b",
            "coulomb_friction": "f_c",
            "static_friction": "f_s / f_c",
            "stribeck_rate": "ω_s",
            "presliding": "z_s",
            "cogging": "A",
            "cogging_count": "n",
            "play": "γ",
            "encoder_on_motor": "-",
            "torque_noise": "σ_ν",
        },
    ),
    Section(
        "Surroundings",
        """    slope       gravity leans by α, so that the ground rises towards +x
    waves       F = -M g β sin(2π x / λ + φ), the weight on ground whose slope varies
    air         F = -½ ρ_air C_d A v |v| at the centre of mass, A = track · 2 l
    tyres       N = -μ M g (width / 4) tanh(ψ̇ / 0.5 rad/s) about the vertical
""",
        {"slope": "α", "waves": "β", "wave_length": "λ / r", "drag": "C_d", "scrub": "μ"},
    ),
    Section(
        "Sensors",
        """    gyro            ω_g = θ̇ + b_g,   b_g = b₀ + a random walk
    tilt            dθ̂/dt = ω_g + (θ - arctan(a / g) - θ̂) / T_f; T_f = 0: θ̂ = θ
    low-pass        T_l dy/dt = θ̂ - y, likewise for ω_g; the tilt is sent with the mounting angle added
    encoders        whole ticks of 2π / N; the rate is the ticks of the last t_w over t_w
    acceleration    change of the axle's speed over the control period

a is the axle's acceleration: an accelerometer takes speeding up for leaning back. White noise is added to each.
""",
        {
            "mounting_angle": "-",
            "fusion_time": "T_f",
            "filter_time": "T_l",
            "gyro_bias": "b₀",
            "gyro_walk": "-",
            "ticks": "N",
            "rate_window": "t_w",
        },
    ),
)

TAIL = """## What is not simulated

- Falls: the body has no shape, so it swings through the ground. A robot beyond 60° has stopped its motors by then.
- Flexible bodies, tyres that deform or lift off a rough floor, and slip sideways beyond what friction of 1 holds.
- Motors' currents: the command is a torque, and back-EMF a viscous friction that does not depend on the supply.
- Temperature, wear, and a battery that runs down from one rollout to the next.
- A latency of the serial line: in lockstep the clock waits for the host.
"""


def page() -> str:
    """All of it."""
    conf = yaml.safe_load(CONF.read_text())
    hard = conf["hard"]
    head = HEAD.format(outer=hard["outer"], reference=hard["reference_torque"])
    parts = [f"## {s.title}\n{s.text}\n{table(s.ranges, conf)}" for s in SECTIONS]
    return "\n".join([head, *parts, noise(conf), TAIL])


def table(ranges: dict[str, str], conf: dict[str, Any]) -> str:
    """Ranges of some settings by choice."""
    rows = {row.key.removeprefix("faults."): row for row in FAULTS}
    lines = [f"| `faults.` | symbol | unit | {' | '.join(CHOICES)} | meaning |", "|---" * (4 + len(CHOICES)) + "|"]
    for name, symbol in ranges.items():
        row = rows[name]
        drawn = " | ".join(spread(conf[choice][name]) for choice in CHOICES)
        lines.append(
            f"| {name} | {symbol.replace('|', chr(92) + '|')} | {row.kind.unit or '-'} | {drawn} | {row.meaning} |"
        )
    return "\n".join([*lines, ""])


def spread(pair: list[float]) -> str:
    """As `0 to 4`, or one value."""
    low, high = (f"{value:g}" for value in pair)
    return low if low == high else f"{low} to {high}"


def noise(conf: dict[str, Any]) -> str:
    """Standard deviations of the sensors' noise."""
    units = {row.key.removeprefix("faults.noise."): row.kind.unit for row in FAULTS if "noise." in row.key}
    lines = [f"| noise of | unit | {' | '.join(CHOICES)} |", "|---" * (2 + len(CHOICES)) + "|"]
    for name, unit in units.items():
        sizes = " | ".join(format(conf[choice]["noise"][name], "g") for choice in CHOICES)
        lines.append(f"| {name} | {unit} | {sizes} |")
    return "\n".join([*lines, ""])


def tabulated() -> set[str]:
    """Names of all settings that the page has a row for."""
    return set(re.findall(r"^\| (\w+) \|", page(), flags=re.MULTILINE))


if __name__ == "__main__":
    PAGE.write_text(page())
