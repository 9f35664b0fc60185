"""What robots did, drawn by PyBullet's software renderer: no window, no graphics card."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import cos, floor, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.sim.bullet import Client, pybullet
from twbal.sim.urdf import urdf_text

Image = NDArray[np.uint8]
_JOINTS = (0, 1)
_COLLISION = re.compile(r"<collision>.*?</collision>", re.DOTALL)
_CYLINDER = re.compile(
    r'<visual>\s*<origin[^>]*/>\s*<geometry><cylinder radius="(.*?)" length="(.*?)"/></geometry>\s*</visual>'
)
_CORNERS = 32  # of a wheel's rim
_SPOKES = 2  # bars across a wheel: without them nobody sees that it turns
_NEAREST = 0.86  # of the size that the camera shows, by which the nearest robot may be nearer than the middle
_TILES = 14  # of the floor, that the camera sees
_PALE, _DARK = (0.93, 0.94, 0.95, 1.0), (0.83, 0.85, 0.87, 1.0)
_WHEEL, _SPOKE = (0.15, 0.17, 0.2, 1.0), (0.75, 0.77, 0.8, 1.0)


class Role(NamedTuple):
    """One robot of the film.

    Attributes:
        poses: (F, 3), frame by frame: position of the axle [m], tilt [rad], wheel angle relative to the body [rad].
        colour: of its body, red, green and blue from 0 to 1.
    """

    poses: Array
    colour: tuple[float, float, float]


def film(robot: RobotParameters, cast: Sequence[Role], width: int, height: int) -> Iterator[Image]:
    """Frames (height, width, 3) of robots that drive side by side; the camera goes along with the first.

    Args:
        robot: how they look.
        cast: at least one, of equally many frames.
        width: of a frame [pixels].
        height: [pixels].
    """
    client = Client()
    try:
        wide = robot.track + robot.wheel_width
        lanes = [1.6 * wide * (i - 0.5 * (len(cast) - 1)) for i in range(len(cast))]
        nearest = 0.5 * wide - lanes[0]  # to the camera
        size = max(2 * robot.com_height + robot.wheel_radius, 2 * robot.wheel_radius, nearest / _NEAREST)
        actors = [_load(client, robot, role.colour) for role in cast]
        tile = 0.5 * size
        tiles = _floor(client, tile, 4.0 * size + len(cast) * robot.track)
        for frame in range(len(cast[0].poses)):
            for actor, role, lane in zip(actors, cast, lanes, strict=True):
                _pose(client, actor, robot, role.poses[frame], lane)
            at = float(cast[0].poses[frame, 0])
            _move_floor(client, tiles, tile, at)
            yield _picture(client, at, size, width, height)
    finally:
        client.close()


def _load(client: Client, robot: RobotParameters, colour: tuple[float, float, float]) -> int:
    wide = replace(robot, wheel_width=max(robot.wheel_width, 0.25 * robot.wheel_radius))
    text = _COLLISION.sub("", urdf_text(wide))  # the renderer would draw these shapes too
    text = _CYLINDER.sub(_wheel_visuals, text)  # it draws a cylinder with round ends: a ball
    actor = client.load(text, {"wheel.obj": _wheel_mesh(wide.wheel_radius, wide.wheel_width)})
    client.changeVisualShape(actor, -1, rgbaColor=[*colour, 1.0])
    return actor


def _wheel_visuals(cylinder: re.Match[str]) -> str:
    """A disc with spokes in place of a cylinder."""
    radius, width = float(cylinder[1]), float(cylinder[2])
    bar = f'<box size="{1.7 * radius!r} {1.04 * width!r} {0.16 * radius!r}"/>'
    spokes = [_visual(bar, pi * k / _SPOKES, _SPOKE) for k in range(_SPOKES)]
    return "".join([_visual('<mesh filename="wheel.obj"/>', 0.0, _WHEEL), *spokes])


def _visual(shape: str, turn: float, colour: tuple[float, float, float, float]) -> str:
    red, green, blue, _ = colour
    material = f'<material name="m{red}"><color rgba="{red} {green} {blue} 1"/></material>'
    return f'<visual><origin rpy="0 {turn!r} 0"/><geometry>{shape}</geometry>{material}</visual>'


def _wheel_mesh(radius: float, width: float) -> str:
    """A disc around the y axis as text of an OBJ file."""
    turns = 2 * np.pi * np.arange(_CORNERS) / _CORNERS
    rim = [(radius * cos(a), side * width / 2, radius * sin(a)) for side in (-1, 1) for a in turns]
    hubs = [(0.0, side * width / 2, 0.0) for side in (-1, 1)]
    near, far = 2 * _CORNERS + 1, 2 * _CORNERS + 2  # OBJ counts from 1
    faces = []
    for k in range(_CORNERS):
        a, b = k + 1, (k + 1) % _CORNERS + 1
        c, d = a + _CORNERS, b + _CORNERS
        faces += [(near, a, b), (far, d, c), (a, c, d), (a, d, b)]
    lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in [*rim, *hubs]]
    return "\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in faces), ""])


def _pose(client: Client, actor: int, robot: RobotParameters, pose: Array, lane: float) -> None:
    position, tilt, wheel = pose.tolist()
    height = robot.com_height  # PyBullet's base is the centre of mass
    lean = tilt + robot.com_offset
    place = [position + height * sin(lean), lane, robot.wheel_radius + height * cos(lean)]
    client.resetBasePositionAndOrientation(actor, place, [0, sin(tilt / 2), 0, cos(tilt / 2)])
    for joint in _JOINTS:
        client.resetJointState(actor, joint, wheel)


def _floor(client: Client, tile: float, breadth: float) -> list[int]:
    """Strips across the way: without them nobody sees that a robot moves."""
    found = []
    for k in range(_TILES):
        shape = client.createVisualShape(
            pybullet.GEOM_BOX,
            halfExtents=[0.5 * tile, breadth, 0.001],
            rgbaColor=_PALE if k % 2 else _DARK,
        )
        found.append(int(client.createMultiBody(0, -1, shape)))
    return found


def _move_floor(client: Client, tiles: Sequence[int], tile: float, at: float) -> None:
    first = 2 * floor((at / tile - _TILES / 2) / 2)
    for k, strip in enumerate(tiles):
        client.resetBasePositionAndOrientation(strip, [(first + k) * tile, 0, -0.001], [0, 0, 0, 1])


def _picture(client: Client, at: float, size: float, width: int, height: int) -> Image:
    view = pybullet.computeViewMatrix(
        cameraEyePosition=[at + 0.6 * size, -3.2 * size, 1.3 * size],
        cameraTargetPosition=[at, 0, 0.42 * size],
        cameraUpVector=[0, 0, 1],
    )
    lens = pybullet.computeProjectionMatrixFOV(fov=38, aspect=width / height, nearVal=0.05 * size, farVal=20 * size)
    _, _, pixels, _, _ = client.getCameraImage(
        width,
        height,
        viewMatrix=view,
        projectionMatrix=lens,
        lightDirection=[1, -2, 3],
        shadow=0,
        lightAmbientCoeff=0.65,
        lightDiffuseCoeff=0.4,
        lightSpecularCoeff=0.0,
        renderer=pybullet.ER_TINY_RENDERER,
    )
    return np.asarray(pixels, dtype=np.uint8).reshape(height, width, 4)[:, :, :3]
