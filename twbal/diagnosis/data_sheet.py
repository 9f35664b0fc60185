"""Values of the data sheet that a fit may change, and what they are called elsewhere."""

from typing import NamedTuple


class SheetFactor(NamedTuple):
    """A field of the planar model that factors a value of the data sheet.

    Attributes:
        effect: of the simulation that does the same.
        parameter: of that effect.
        group: class of the values that data of this kind can hardly tell apart.
        value: of the robot's sheet, whose provenance stands for the factor's.
    """

    effect: str
    parameter: str
    group: str
    value: str


_PULL, _LENGTH = "gain, mass and inertia", "COM height and wheel radius"
DATA_SHEET = {
    "torque_gain_gain": SheetFactor("torque_gain", "gain", _PULL, "torque_limit"),
    "body_mass_factor": SheetFactor("body_mass", "factor", _PULL, "body_mass"),
    "body_inertia_factor": SheetFactor("body_inertia", "factor", _PULL, "body_inertia_pitch"),
    "com_height_factor": SheetFactor("com_height", "factor", _LENGTH, "com_height"),
    "wheel_radius_factor": SheetFactor("wheel_radius", "factor", _LENGTH, "wheel_radius"),
}
"""By field of the planar model."""

WHEELS = ("wheel_mass", "wheel_inertia")
"""Fields of the planar model, and values of the sheet, that are free too and that no effect factors."""
