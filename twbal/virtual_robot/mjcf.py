"""The robot as MuJoCo's model: a free body on two hinges, over a plane."""

from math import cos, sin

from twbal.core.robot_parameters import GRAVITY
from twbal.virtual_robot.ground_truth import Body, GroundTruth

LEFT, RIGHT = 0, 1


def mjcf(truth: GroundTruth, physics_step: float) -> str:
    """The model's XML.

    Wheels touch the ground as spheres: under an axle that is level a sphere meets it where a thin disc would, and rolls
    without error. Hard contacts (`solref` of 2 ms) and friction that is 100 times as stiff keep the slip of a driven
    wheel under 1e-4 of its path.

    Args:
        truth: the robot.
        physics_step: [s].
    """
    body, slope, has_play = truth.body, truth.surroundings.slope, truth.drive.play > 0.0
    roll, pitch, yaw = body.inertia
    x, z = body.com_height * sin(body.com_offset), body.com_height * cos(body.com_offset)
    return f"""<mujoco>
  <option timestep="{physics_step!r}" gravity="{-GRAVITY * sin(slope)!r} 0 {-GRAVITY * cos(slope)!r}"
    integrator="Euler" cone="elliptic" impratio="100" iterations="50" tolerance="1e-12"/>
  <default><geom solref="0.002 1" solimp="0.99 0.999 0.0001" friction="1 0 0" condim="3"/></default>
  <worldbody>
    <geom type="plane" size="0 0 1"/>
    <body name="robot">
      <freejoint/>
      <inertial pos="{x!r} 0 {z!r}" mass="{body.mass!r}" diaginertia="{roll!r} {pitch!r} {yaw!r}"/>
      {_wheel(body, LEFT, has_play)}
      {_wheel(body, RIGHT, has_play)}
    </body>
  </worldbody>
</mujoco>"""


def _wheel(body: Body, side: int, has_play: bool) -> str:
    """A hinge with a wheel; without play the rotor is an inertia of the hinge."""
    across = 0.5 * body.wheel_inertia + body.wheel_mass * body.wheel_width**2 / 12.0
    off, phase = body.eccentricity, body.eccentric_phase[side]
    place = (0.5 if side == LEFT else -0.5) * body.track
    armature = 0.0 if has_play else body.rotor_inertia
    return f"""<body pos="0 {place!r} 0">
        <joint type="hinge" axis="0 1 0" armature="{armature!r}"/>
        <inertial pos="0 0 0" mass="{body.wheel_mass!r}" diaginertia="{across!r} {body.wheel_inertia!r} {across!r}"/>
        <geom type="sphere" size="{body.wheel_radius[side]!r}" pos="{off * sin(phase)!r} 0 {off * cos(phase)!r}"/>
      </body>"""
