"""Robots off their data sheets, and the controllers that their owners gave them."""

from math import sqrt

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from benchmarks.other_robots.drive import Law, Sensors
from benchmarks.other_robots.mechanics import GRAVITY, Machine, unstable_pole
from twbal.core.robot_parameters import RobotParameters

ITEMS = ("tilt filter", "coarse encoder", "shaft encoder", "bias walk", "jitter", "lost rows", "odd rate", "real")
"""Of real sensors and loops: each alone, and all but an odd rate together."""
_USUAL = 0.68  # torque limit of the paper's robot over the torque of its weight, lying


def nominal(sheet: RobotParameters) -> Machine:
    """The machine that a data sheet describes."""
    return Machine(
        mass=sheet.body_mass,
        height=sheet.com_height,
        offset=sheet.com_offset,
        pitch_inertia=sheet.body_inertia_pitch,
        roll_inertia=sheet.body_inertia_roll,
        yaw_inertia=sheet.body_inertia_yaw,
        wheel_mass=sheet.wheel_mass,
        wheel_inertia=sheet.wheel_inertia,
        radius=sheet.wheel_radius,
        half_track=0.5 * sheet.track,
        load=(sheet.body_mass + 2.0 * sheet.wheel_mass) * GRAVITY,
    )


def built(sheet: RobotParameters, tolerance: float, rng: np.random.Generator) -> Machine:
    """A robot as it was built: each number off by up to the tolerance, the motors uneven by up to 2 %."""
    m, (mass, height, inertia, wheel, wheel_inertia, radius, gain) = (
        nominal(sheet),
        1.0 + tolerance * rng.uniform(-1.0, 1.0, 7),
    )
    made = m._replace(
        mass=m.mass * mass,
        height=m.height * height,
        pitch_inertia=m.pitch_inertia * inertia,
        roll_inertia=m.roll_inertia * inertia,
        yaw_inertia=m.yaw_inertia * inertia,
        wheel_mass=m.wheel_mass * wheel,
        wheel_inertia=m.wheel_inertia * wheel_inertia,
        radius=m.radius * radius,
        gain=gain,
        uneven=0.02 * rng.uniform(-1.0, 1.0),
        bristle=rng.uniform(0.002, 0.005),
    )
    return made._replace(load=(made.mass + 2.0 * made.wheel_mass) * GRAVITY)


def torque_unit(sheet: RobotParameters) -> float:
    """Torque of a robot over that of the paper's: of its limit, and of what it needs to stand where that is less."""
    needed = _USUAL * sheet.body_mass * GRAVITY * sheet.com_height
    return sqrt(sheet.torque_limit * min(sheet.torque_limit, needed)) / 20.0


def is_real(item: str, sensors: str) -> bool:
    """Whether an item of ITEMS is real in a set whose `sensors` are these."""
    return sensors in ("real", item)


def drawn_sensors(quality: str, sheet: RobotParameters, rng: np.random.Generator) -> Sensors:
    """Fine sensors with white noise, but for what is real of them, which `quality` says: see `sets.Set.sensors`."""
    quiet = rng.uniform(0.5, 1.5, 4)
    ideal = Sensors(
        tilt=0.002 * quiet[0],
        gyro=0.01 * quiet[1],
        wheel_rate=0.03 * quiet[3],
        acceleration=0.1 * quiet[2],
        tilt_constant=0.0,
        height=0.0,
        ticks=4096.0,
        differenced=0.0,
        on_shaft=0.0,
    )
    constant = float(np.exp(rng.uniform(np.log(0.3), np.log(2.0))))
    height = rng.uniform(0.2, 1.2) * sheet.com_height
    ticks = float(round(np.exp(rng.uniform(np.log(300), np.log(2000)))))
    shaft = float(rng.integers(2))
    found = ideal
    if is_real("tilt filter", quality):
        found = found._replace(acceleration=0.2 * quiet[2], tilt_constant=constant, height=height)
    if is_real("coarse encoder", quality):
        found = found._replace(wheel_rate=0.0, ticks=ticks, differenced=1.0)
    if is_real("shaft encoder", quality):
        found = found._replace(on_shaft=shaft if quality == "real" else 1.0)
    return found


def _linear(m: Machine) -> tuple[np.ndarray, np.ndarray]:
    """Rates of (tilt, tilt rate, speed) near the balance, by themselves (3, 3) and by the torque (3, 1)."""
    vv = m.mass + 2.0 * m.wheel_mass + 2.0 * m.wheel_inertia / m.radius**2
    vq, qq = m.mass * m.height, m.pitch_inertia + m.mass * m.height**2
    determinant, falls = vv * qq - vq**2, m.mass * GRAVITY * m.height
    by_torque = np.array([0.0, (-vv - vq / m.radius) / determinant, (qq / m.radius + vq) / determinant])
    a = np.array([[0.0, 1.0, 0.0], [vv * falls / determinant, 0.0, 0.0], [-vq * falls / determinant, 0.0, 0.0]])
    return a, by_torque[:, None]


def regulator(sheet: RobotParameters, stiffness: float) -> Law:
    """A linear-quadratic regulator of the data sheet with a delay of one period; `stiffness` 1 is usual."""
    m = nominal(sheet)
    a, b = _linear(m)
    block = expm(np.block([[a, b], [np.zeros((1, 4))]]) * sheet.control_period)
    # The last command still acts, so that the regulator leaves room for what its robot is late by.
    transition = np.block([[block[:3, :3], block[:3, 3:]], [np.zeros((1, 4))]])
    enters = np.array([[0.0], [0.0], [0.0], [1.0]])
    pole = unstable_pole(m)
    widths = np.array([0.1, 0.1 * pole, 0.5])
    command = stiffness * 0.2 * 20.0 * torque_unit(sheet)
    cost = np.diag([*(widths**-2.0), 1e-9])
    p = solve_discrete_are(transition, enters, cost, np.array([[command**-2.0]]))
    k = np.linalg.solve(enters.T @ p @ enters + command**-2.0, enters.T @ p @ transition)[0]
    return _law(sheet, tilt=-k[0], rate=-k[1], speed=-k[2])


def cascade(sheet: RobotParameters, stiffness: float) -> Law:
    """PD of the tilt inside of PI of the speed, by their bandwidths; `stiffness` 1 is usual."""
    m = nominal(sheet)
    a, b = _linear(m)
    pole = unstable_pole(m)
    inner = min(1.6 * stiffness * pole, 0.5 / sheet.control_period)
    outer = 0.25 * pole * sqrt(stiffness)
    grows, turns = a[1, 0], -b[1, 0]
    speeds = steady_acceleration(m)
    return _law(
        sheet,
        tilt=(grows + inner**2) / turns,
        rate=1.8 * inner / turns,
        lean=outer / speeds,
        lean_integral=0.25 * outer**2 / speeds,
    )


def steady_acceleration(m: Machine) -> float:
    """Acceleration of a robot that leans steadily, over its lean [m/s² per rad]."""
    a, b = _linear(m)
    return float(a[2, 0] - b[2, 0] * a[1, 0] / b[1, 0])


def _law(
    sheet: RobotParameters, tilt: float, rate: float, speed: float = 0.0, lean: float = 0.0, lean_integral: float = 0.0
) -> Law:
    limit = min(sheet.torque_limit, 4.0 * 20.0 * torque_unit(sheet))
    return Law(
        tilt=float(tilt),
        rate=float(rate),
        speed=float(speed),
        lean=float(lean),
        lean_integral=float(lean_integral),
        most_lean=0.15,
        smooth=0.03 if lean else 0.0,
        turn=_turning(sheet),
        limit=limit,
        radius=sheet.wheel_radius,
        fade=0.25,
    )


def _turning(sheet: RobotParameters) -> float:
    """Gain that brings a yaw rate to what is asked within half a second."""
    b, r = 0.5 * sheet.track, sheet.wheel_radius
    inertia = sheet.body_inertia_yaw + 2.0 * sheet.wheel_mass * b**2 + 2.0 * sheet.wheel_inertia * (b / r) ** 2
    return inertia * r / (2.0 * b) / 0.5
