"""A two-wheeled robot in MuJoCo, made from the numbers of a data sheet and no other code of twbal's."""

from dataclasses import dataclass, replace
from math import cos, sin
from typing import Any

import mujoco
import numpy as np

STEP = 0.0005  # of the physics [s]
GRAVITY = 9.81


@dataclass(frozen=True)
class Body:
    """What the robot is made of, in SI units; left and right wheel apart.

    Attributes:
        mass: of the body. height: of its centre of mass over the axle. offset: angle by which that lies in front.
        inertia: of the body about its centre of mass, roll, pitch, yaw. wheel_mass, wheel_inertia: of each wheel.
        radius: of both. uneven: share by which the left motor is stronger, and the right one weaker, than their mean.
        track: between the wheels. grip: dry friction of the tyres.
        mast: mass that swings on a spring at the body's top; 0 has none. mast_frequency: of that [Hz].
    """

    mass: float
    height: float
    offset: float
    inertia: tuple[float, float, float]
    wheel_mass: float
    wheel_inertia: float
    radius: float
    uneven: float
    track: float
    grip: float = 1.0
    mast: float = 0.0
    mast_frequency: float = 4.0


def drawn(sheet: Any, rng: np.random.Generator, tolerance: float, asymmetry: float) -> Body:
    """A robot as it left the factory: each number off by up to the tolerance, the motors by the asymmetry."""

    def off(value: float) -> float:
        return value * (1 + tolerance * rng.uniform(-1, 1))

    inertia = off(1.0)
    return Body(
        mass=off(sheet.body_mass),
        height=off(sheet.com_height),
        offset=sheet.com_offset,
        inertia=tuple(inertia * i for i in (sheet.body_inertia_roll, sheet.body_inertia_pitch, sheet.body_inertia_yaw)),
        wheel_mass=off(sheet.wheel_mass),
        wheel_inertia=off(sheet.wheel_inertia),
        radius=off(sheet.wheel_radius),
        uneven=asymmetry * rng.uniform(-1, 1) / 2,
        track=sheet.track,
    )


def mjcf(b: Body) -> str:
    """The model: spheres roll, as a disc with its edge on the ground would; damping only where it is asked for."""
    x, z = b.height * sin(b.offset), b.height * cos(b.offset)
    across = b.wheel_inertia / 2
    wheels = "".join(
        f"""
      <body name="{name}" pos="0 {side * b.track / 2} 0">
        <joint name="{name}" type="hinge" axis="0 1 0" damping="0" frictionloss="0"/>
        <inertial pos="0 0 0" mass="{b.wheel_mass}" diaginertia="{across} {b.wheel_inertia} {across}"/>
        <geom type="sphere" size="{b.radius}" friction="{b.grip} 0 0" condim="3" mass="0"/>
      </body>"""
        for name, side in (("left", 1), ("right", -1))
    )
    stiffness = b.mast * 0.3**2 * (2 * np.pi * b.mast_frequency) ** 2
    mast = (
        f"""
      <body name="mast" pos="{2 * x} 0 {2 * z}">
        <joint name="mast" type="hinge" axis="0 1 0" stiffness="{stiffness}" damping="{0.02 * stiffness / 10}"/>
        <inertial pos="0 0 0.3" mass="{b.mast}" diaginertia="1e-4 1e-4 1e-4"/>
      </body>"""
        if b.mast
        else ""
    )
    roll, pitch, yaw = b.inertia
    return f"""<mujoco>
  <option timestep="{STEP}" gravity="0 0 {-GRAVITY}" integrator="Euler"
    cone="elliptic" impratio="100" iterations="50" tolerance="1e-12"/>
  <default><geom solref="0.002 1" solimp="0.99 0.999 0.0001"/></default>
  <worldbody>
    <geom type="plane" size="0 0 1" friction="{b.grip} 0 0" condim="3"/>
    <body name="robot" pos="0 0 {b.radius}">
      <freejoint/>
      <inertial pos="{x} 0 {z}" mass="{b.mass}" diaginertia="{roll} {pitch} {yaw}"/>{wheels}{mast}
    </body>
  </worldbody>
</mujoco>"""


class Ride:
    """The robot on its wheels; torques and pushes are set before each step."""

    def __init__(self, body: Body, slope: float = 0.0) -> None:
        self.body = body
        self.model = mujoco.MjModel.from_xml_string(mjcf(body))
        self.model.opt.gravity[:] = -GRAVITY * sin(slope), 0.0, -GRAVITY * cos(slope)
        self.slope = slope
        self.data = mujoco.MjData(self.model)
        self._robot = self.model.body("robot").id
        self._joints = [self.model.joint(name).id for name in ("left", "right")]
        self.places = [int(self.model.jnt_qposadr[j]) for j in self._joints]
        self.rates = [int(self.model.jnt_dofadr[j]) for j in self._joints]

    def place(self, tilt: float, tilt_rate: float, speed: float) -> None:
        """Put it at its start, wheels rolling."""
        mujoco.mj_resetData(self.model, self.data)
        lean = tilt + self.slope
        self.data.qpos[3:7] = cos(lean / 2), 0.0, sin(lean / 2), 0.0
        self.data.qvel[0], self.data.qvel[4] = speed, tilt_rate
        for rate in self.rates:
            self.data.qvel[rate] = speed / self.body.radius - tilt_rate
        mujoco.mj_forward(self.model, self.data)

    def forward(self) -> np.ndarray:
        """The body's x axis in the world."""
        return np.array(self.data.xmat[self._robot].reshape(3, 3)[:, 0])

    def tilt(self) -> float:
        """From the vertical [rad]."""
        axes = self.data.xmat[self._robot].reshape(3, 3)
        up = np.array([sin(self.slope), 0.0, cos(self.slope)])
        return float(np.arctan2(-(up @ axes[:, 0]), up @ axes[:, 2]))

    def tilt_rate(self) -> float:
        """About the axle [rad/s]; a free joint's angular velocity is in the body's axes."""
        return float(self.data.qvel[4])

    def yaw_rate(self) -> float:
        """About the vertical [rad/s]."""
        spin = self.data.xmat[self._robot].reshape(3, 3) @ self.data.qvel[3:6]
        return float(spin[2])

    def speed(self) -> float:
        """Of the axle, forward [m/s]."""
        x = self.forward()
        return float(self.data.qvel[:2] @ x[:2] / np.hypot(x[0], x[1]))

    def wheels(self) -> tuple[np.ndarray, np.ndarray]:
        """Angles [rad] and rates [rad/s] of both wheels relative to the body."""
        return self.data.qpos[self.places], self.data.qvel[self.rates]

    def step(self, on_wheels: np.ndarray, on_body: float, outside: np.ndarray, push: float) -> None:
        """One step.

        Args:
            on_wheels: (2,) torque in each joint, which acts back on the body [N·m].
            on_body: torque on the body beside that, as a motor's on its housing [N·m].
            outside: (2,) torque on each wheel from outside [N·m].
            push: force on the axle along the ground [N].
        """
        self.data.qfrc_applied[:] = 0.0
        self.data.qfrc_applied[self.rates] = on_wheels + outside
        # From outside there is no reaction on the body: a torque on a wheel turns the coordinates of both.
        self.data.qfrc_applied[4] = outside.sum() + on_body
        x = self.forward()
        level = np.hypot(x[0], x[1])
        self.data.qfrc_applied[0], self.data.qfrc_applied[1] = push * x[0] / level, push * x[1] / level
        mujoco.mj_step(self.model, self.data)


def changed(body: Body, **factors: float) -> Body:
    """A body with some numbers times a factor; `inertia` scales all three."""
    values: dict[str, Any] = {}
    for name, factor in factors.items():
        value = getattr(body, name)
        values[name] = tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value
    return replace(body, **values)
