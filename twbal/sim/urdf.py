"""The robot as URDF text."""

from dataclasses import replace
from math import cos, sin
from numbers import Real
from typing import Any

from twbal.core.robot_parameters import RobotParameters
from twbal.core.swinging_part import SwingingPart

WHEELS = (("left_wheel", 0.5), ("right_wheel", -0.5))
"""Names of the wheel links and where they sit on y, in tracks."""


def urdf_text(robot: RobotParameters, part: SwingingPart | None = None) -> str:
    """URDF of the robot; the frame of its base link `body` is the middle of the axle.

    A part that swings is a link of its own, after the wheels.

    The wheels collide as spheres: with cylinders, PyBullet's contact points stick to the wheel off its lowest point and
    the axle bounces. The cylinder is what is seen. The body collides with nothing.
    """
    # Numbers of numpy are written in a way that PyBullet reads as 0.
    numbers: dict[str, Any] = {key: float(value) for key, value in vars(robot).items() if isinstance(value, Real)}
    robot = replace(robot, **numbers)
    part = SwingingPart(*map(float, part)) if part else None
    x = robot.com_height * sin(robot.com_offset)
    z = robot.com_height * cos(robot.com_offset)
    body = f"""  <link name="body">
    {_inertial(robot.body_mass, robot.body_inertia_roll, robot.body_inertia_pitch, robot.body_inertia_yaw, x, z)}
    <visual>
      <origin xyz="0 0 {robot.com_height!r}"/>
      <geometry><box size="{robot.wheel_radius!r} {0.8 * robot.track!r} {2 * robot.com_height!r}"/></geometry>
    </visual>
  </link>"""
    wheels = [_wheel(robot, name, side * robot.track) for name, side in WHEELS]
    parts = [_swinging(robot, part)] if part else []
    return "\n".join([f'<robot name="{robot.name}">', body, *wheels, *parts, "</robot>", ""])


def _wheel(robot: RobotParameters, name: str, y: float) -> str:
    """A wheel and the joint that it turns on; a positive joint angle rolls forward."""
    across = robot.wheel_mass * (3 * robot.wheel_radius**2 + robot.wheel_width**2) / 12
    across = max(across, 0.5001 * robot.wheel_inertia)  # engines refuse a body less than half of its spin across
    return f"""  <link name="{name}">
    {_inertial(robot.wheel_mass, across, robot.wheel_inertia, across)}
    <visual>
      <origin rpy="1.5707963267948966 0 0"/>
      <geometry><cylinder radius="{robot.wheel_radius!r}" length="{robot.wheel_width!r}"/></geometry>
    </visual>
    <collision>
      <geometry><sphere radius="{robot.wheel_radius!r}"/></geometry>
    </collision>
  </link>
  <joint name="{name}_joint" type="continuous">
    <parent link="body"/>
    <child link="{name}"/>
    <origin xyz="0 {y!r} 0"/>
    <axis xyz="0 1 0"/>
  </joint>"""


def _swinging(robot: RobotParameters, part: SwingingPart) -> str:
    """The part of the body that swings, a point mass, and the joint that it slides on, forward."""
    along, across = sin(robot.com_offset), cos(robot.com_offset)
    tiny = 1e-6 * part.mass * part.height**2
    return f"""  <link name="swinging_part">
    {_inertial(part.mass, tiny, tiny, tiny)}
  </link>
  <joint name="swinging_part_joint" type="prismatic">
    <parent link="body"/>
    <child link="swinging_part"/>
    <origin xyz="{part.height * along!r} 0 {part.height * across!r}"/>
    <axis xyz="{across!r} 0 {-along!r}"/>
    <limit lower="-10" upper="10" effort="1e9" velocity="1e9"/>
  </joint>"""


def _inertial(mass: float, ixx: float, iyy: float, izz: float, x: float = 0.0, z: float = 0.0) -> str:
    return f"""<inertial>
      <origin xyz="{x!r} 0 {z!r}"/>
      <mass value="{mass!r}"/>
      <inertia ixx="{ixx!r}" ixy="0" ixz="0" iyy="{iyy!r}" iyz="0" izz="{izz!r}"/>
    </inertial>"""
