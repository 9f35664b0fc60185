"""A drive in Rerun: the robot in space and its quantities over time; the only module that knows the SDK."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from twbal.core.gaussian import Array
from twbal.core.palette import GOOD, PREDICTED, REAL, Colour
from twbal.viz.live.sample import Sample
from twbal.viz.live.shape import Shape

TIMELINE = "time"
"""Since the drive began."""
_LATELY = 30.0  # of the plots that are shown while the robot drives [s]
_TRAIL, _TRAIL_STEP = 300, 0.02  # points of the way that are shown, and their distance [m]
_TRAIL_EVERY = 0.3  # s
_FLOOR, _TILE = 20, 0.5  # tiles from the middle to the edge, and their side [m]


class Line(NamedTuple):
    """A quantity over time.

    Attributes:
        path: of its entity.
        field: of `Sample`.
        label: with the unit.
        colour: of the line.
        factor: from the unit of the sample to that which is shown.
    """

    path: str
    field: str
    label: str
    colour: Colour
    factor: float = 1.0


_DEGREES = float(np.degrees(1.0))
LINES = (
    Line("plots/tilt/robot", "tilt", "tilt [°]", REAL, _DEGREES),
    Line("plots/place/reference", "reference_place", "reference [m]", PREDICTED),
    Line("plots/place/robot", "place", "robot [m]", REAL),
    Line("plots/speed/asked", "asked_speed", "asked [m/s]", GOOD),
    Line("plots/speed/reference", "reference_speed", "reference [m/s]", PREDICTED),
    Line("plots/speed/robot", "speed", "robot [m/s]", REAL),
    Line("plots/heading/reference", "reference_heading", "reference [°]", PREDICTED, _DEGREES),
    Line("plots/heading/robot", "heading", "robot [°]", REAL, _DEGREES),
    Line("plots/command/command", "command", "command [N·m]", REAL),
)
"""What is plotted; a quantity that is NaN all the time is left out."""


class Scene:
    """A recording of a drive; see `Sample` for the quantities. x is ahead of where the robot was put, z up.

    Where the robot is follows from its place along its way and its heading, as its sensors have them.

    Args:
        shape: of the robot.
        stream: of Rerun, which has a sink.
    """

    def __init__(self, shape: Shape, stream: rr.RecordingStream) -> None:
        self._shape, self._stream = shape, stream
        self._robot, self._asked = _Way(shape.wheel_radius), _Way(shape.wheel_radius)
        self._trail: list[Array] = []
        self._trail_due = 0.0  # s
        self._log_what_stays()

    def draw(self, samples: Array) -> None:
        """Add samples, (N, 11), later than those before."""
        if not len(samples):
            return
        seen: dict[str, Array] = dict(zip(Sample._fields, samples.T, strict=True))
        index = rr.TimeColumn(TIMELINE, duration=seen["time"])
        for line in LINES:
            values = line.factor * seen[line.field]
            if not np.isnan(values).all():
                self._send(line.path, index, rr.Scalars.columns(scalars=values))
        heading = np.nan_to_num(seen["heading"])
        places = self._robot.follow(seen["place"], heading)
        self._move("world/robot", index, places, _about((0.0, 0.0, 1.0), heading))
        self._move("world/robot/body", index, None, _about((0.0, 1.0, 0.0), seen["tilt"]))
        apart = 0.5 * self._shape.track / self._shape.wheel_radius * heading
        for name, wheel in (("left", seen["wheel"] - apart), ("right", seen["wheel"] + apart)):
            self._move(f"world/robot/{name}_wheel/turned", index, None, _about((0.0, 1.0, 0.0), wheel))
        asked = np.nan_to_num(seen["reference_heading"])
        self._move(
            "world/reference", index, self._asked.follow(seen["reference_place"], asked), _about((0, 0, 1), asked)
        )
        self._draw_trail(places, float(seen["time"][-1]))

    def tell(self, time: float, text: str) -> None:
        """Add what happened at a time [s]."""
        self._stream.set_time(TIMELINE, duration=time)
        self._stream.log("events", rr.TextLog(text))

    def _draw_trail(self, places: Array, time: float) -> None:
        before = len(self._trail)
        for place in places:
            if not self._trail or np.linalg.norm(place - self._trail[-1]) >= _TRAIL_STEP:
                self._trail.append(place)
        if len(self._trail) > max(before, 1) and time >= self._trail_due:
            self._trail, self._trail_due = self._trail[-_TRAIL:], time + _TRAIL_EVERY
            points = np.array(self._trail) - [0.0, 0.0, 0.99 * self._shape.wheel_radius]
            self._stream.set_time(TIMELINE, duration=time)
            self._stream.log("world/way", rr.LineStrips3D([points], colors=[_rgb(REAL)], radii=[0.004]))

    def _send(self, path: str, index: rr.TimeColumn, columns: rr.ComponentColumnList) -> None:
        rr.send_columns(path, indexes=[index], columns=columns, recording=self._stream)

    def _move(self, path: str, index: rr.TimeColumn, places: Array | None, turned: Array) -> None:
        if places is None:
            self._send(path, index, rr.Transform3D.columns(quaternion=turned))
        else:
            self._send(path, index, rr.Transform3D.columns(translation=places, quaternion=turned))

    def _log_what_stays(self) -> None:
        shape, log = self._shape, self._stream.log
        log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        log("world/floor", _floor(), static=True)
        body = np.array([shape.wheel_radius, 0.8 * shape.track, 2.0 * shape.com_height])
        box = rr.Boxes3D(sizes=[body], centers=[(0.0, 0.0, shape.com_height)], colors=[_rgb(REAL)], fill_mode="solid")
        log("world/robot/body/box", box, static=True)
        for side, name in ((0.5, "left"), (-0.5, "right")):
            log(f"world/robot/{name}_wheel", rr.Transform3D(translation=[0, side * shape.track, 0]), static=True)
            log(f"world/robot/{name}_wheel/turned/disc", _disc(shape), static=True)
            log(f"world/robot/{name}_wheel/turned/spokes", _spokes(shape), static=True)
        arrow = rr.Arrows3D(
            vectors=[(2.0 * shape.wheel_radius, 0.0, 0.0)],
            origins=[(0.0, 0.0, -0.99 * shape.wheel_radius)],
            colors=[_rgb(PREDICTED)],
            labels=["reference"],
        )
        log("world/reference/arrow", arrow, static=True)
        for line in LINES:
            log(line.path, rr.SeriesLines(colors=[_rgb(line.colour)], names=[line.label]), static=True)


class _Way:
    """Where a robot is whose place along its way and heading are known.

    Args:
        height: of its axle [m].
    """

    def __init__(self, height: float) -> None:
        self._x = self._y = self._place = self._heading = 0.0
        self._height = height

    def follow(self, places: Array, headings: Array) -> Array:
        """The points after further places [m] and headings [rad], (N, 3) for (N,) each."""
        steps = np.diff(places, prepend=self._place)
        middle = headings - 0.5 * np.diff(headings, prepend=self._heading)
        x = self._x + np.cumsum(steps * np.cos(middle))
        y = self._y + np.cumsum(steps * np.sin(middle))
        self._x, self._y, self._place, self._heading = x[-1], y[-1], places[-1], headings[-1]
        return np.column_stack([x, y, np.full(len(x), self._height)])


def save(shape: Shape, path: Path) -> tuple[Scene, rr.RecordingStream]:
    """A scene that goes to a file, and its stream, which is to be disconnected at the end."""
    stream = _stream(shape)
    stream.save(path, default_blueprint=layout(lately=False))
    return Scene(shape, stream), stream


def show(shape: Shape, address: str | None) -> tuple[Scene, rr.RecordingStream]:
    """A scene in a viewer, and its stream; see `save`.

    Args:
        shape: of the robot.
        address: of a viewer that runs, such as `rerun+http://127.0.0.1:9876/proxy`; None: one is started.
    """
    stream = _stream(shape)
    if address is None:
        stream.spawn(default_blueprint=layout(lately=True), hide_welcome_screen=True)
    else:
        stream.connect_grpc(address, default_blueprint=layout(lately=True))
    return Scene(shape, stream), stream


def layout(lately: bool) -> rrb.Blueprint:
    """The robot to the left, its plots to the right; `lately`: these show the last half minute only."""
    cursor = rrb.TimeRangeBoundary.cursor_relative
    ranges = [rrb.VisibleTimeRange(TIMELINE, start=cursor(seconds=-_LATELY), end=cursor())] if lately else None
    names = dict.fromkeys(line.path.split("/")[1] for line in LINES)
    plots = [rrb.TimeSeriesView(origin=f"plots/{name}", name=name, time_ranges=ranges) for name in names]
    space = rrb.Spatial3DView(origin="world", name="robot")
    return rrb.Blueprint(rrb.Horizontal(space, rrb.Vertical(*plots)), collapse_panels=True)


def _stream(shape: Shape) -> rr.RecordingStream:
    return rr.RecordingStream(f"twbal_{shape.name}")


def _about(axis: Sequence[float], angles: Array) -> Array:
    """Quaternions of turns about an axis by angles [rad], (N, 4) with the real part last."""
    half = 0.5 * np.asarray(angles)
    return np.column_stack([*(part * np.sin(half) for part in axis), np.cos(half)])


def _rgb(colour: Colour) -> list[int]:
    return [round(255 * part) for part in colour.parts]


def _disc(shape: Shape) -> rr.Cylinders3D:
    across = rr.RotationAxisAngle(axis=[1.0, 0.0, 0.0], degrees=90.0)
    return rr.Cylinders3D(
        lengths=[shape.wheel_width],
        radii=[shape.wheel_radius],
        rotation_axis_angles=[across],
        colors=[[60, 66, 74]],
        fill_mode="solid",
    )


def _spokes(shape: Shape) -> rr.Boxes3D:
    """Without them nobody sees that a wheel turns."""
    long, short = 1.7 * shape.wheel_radius, 0.16 * shape.wheel_radius
    wide = 1.04 * shape.wheel_width
    sizes = [(long, wide, short), (short, wide, long)]
    return rr.Boxes3D(sizes=sizes, colors=[[220, 224, 230]], fill_mode="solid")


def _floor() -> rr.LineStrips3D:
    """Lines half a metre apart."""
    edge = _FLOOR * _TILE
    at = np.arange(-_FLOOR, _FLOOR + 1) * _TILE
    along = [[(-edge, y, 0.0), (edge, y, 0.0)] for y in at]
    across = [[(x, -edge, 0.0), (x, edge, 0.0)] for x in at]
    return rr.LineStrips3D([*along, *across], colors=[[90, 96, 104]], radii=[0.001])
