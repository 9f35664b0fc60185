"""Units in the names of columns: which one a name states, in whichever form people write it."""

import re
from typing import NamedTuple

from twbal.io.importers.mapping import UNITS

COUNTED = ("counts", "ticks")
"""Units of an encoder's numbers."""

SPEEDS = frozenset({"m/s", "cm/s", "mm/s"})
"""Units of a speed on the ground."""

_OTHER_UNITS = {*SPEEDS, "%", "A", "mA", "N", *COUNTED}  # that tell what a column is not
_TIMES = {"ms", "us", "ns"}  # units that stand for the column of the time
_OF_ANGLES = r"rad(?:ians?)?|deg(?:rees?)?|°|º|rev(?:olution)?s?|turns?"
_OF_LENGTHS = "mm|cm|m"
_A_SECOND = r"(?:/|_per_|\s+per\s+)s(?:ecs?|econds?)?"
_OF_RATES = rf"(?:{_OF_ANGLES}|{_OF_LENGTHS}){_A_SECOND}"
_OF_ACCELERATIONS = r"m/s(?:ec)?(?:²|2|\^2|\*\*2|/s(?:ec)?)"
_OF_TORQUES = "nm|mnm|m?n[.·*⋅]m"
_UNIT = re.compile(
    r"[\[(]([^\])]+)[\])]"
    rf"|(?<=.)_({_OF_RATES}|{_OF_ACCELERATIONS}|(?:rad|deg|m)_s(?:ec)?|m_s2|{_OF_TORQUES}|revs|revolutions|turns"
    rf"|(?<!per_)(?:s|ms|us|ns|rad|deg|dps|rpm|rps)|{_OF_LENGTHS}|v|mv)$"
    rf"|(?<=.) ({_OF_RATES}|{_OF_ACCELERATIONS}|{_OF_TORQUES}|s|ms|us|ns|rad|deg|degrees|°|dps|rpm|rps|mm|cm)$",
    re.I,
)
_RATE = re.compile(rf"({_OF_ANGLES}|{_OF_LENGTHS}){_A_SECOND}")
_ACCELERATION = re.compile(rf"{_OF_ACCELERATIONS}|m_s2")
_ALIASES = {
    **{"sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "usec": "us", "nsec": "ns"},
    **{"rad_s": "rad/s", "deg_s": "deg/s", "m_s": "m/s", "rad_sec": "rad/s", "deg_sec": "deg/s", "m_sec": "m/s"},
    **{"dps": "deg/s", "rps": "turn/s", "º": "°"},
    **dict.fromkeys(("degree", "degrees"), "deg"),
    **dict.fromkeys(("radian", "radians"), "rad"),
    **dict.fromkeys(("rev", "revs", "revolution", "revolutions", "turns"), "turn"),
    **{"v": "V", "volt": "V", "volts": "V", "mv": "mV", "nm": "N·m", "mnm": "mNm"},
    **{f"n{dot}m": "N·m" for dot in " .·*⋅"},
    **{f"mn{dot}m": "mNm" for dot in " .·*⋅"},
    **{"count": "counts", "tick": "ticks", "steps": "counts", "pulse": "counts", "pulses": "counts"},
    "μs": "µs",  # the Greek letter; else it is the micro sign
}
"""Other forms of units, in small letters."""
_RANGE = re.compile(r"[+-]?\d+\s*(?:\.\.+|…|-|–|to)\s*[+-]?\d+")  # in the place of a unit, as in `pwm [-255..255]`


class StatedUnit(NamedTuple):
    """The unit that a name states, "" without one, and the name without it."""

    unit: str
    bare: str


def stated_unit(name: str) -> StatedUnit:
    """The unit that a column's name states: in brackets, or at its end behind a blank or an underscore."""
    if name.lower() in _TIMES:
        return StatedUnit(name.lower(), name)
    for found in _UNIT.finditer(name):
        written = (found[1] or found[2] or found[3]).strip()
        if _RANGE.fullmatch(written):
            return StatedUnit("", name.replace(found[0], " "))
        if unit := _known(written):
            return StatedUnit(unit, name.replace(found[0], " "))
    return StatedUnit("", name)


def is_unit(text: str) -> bool:
    """Whether a text is a unit, with or without brackets."""
    return bool(stated_unit(f"x [{text.strip('[]() ')}]").unit)


def _known(written: str) -> str:
    """A unit as a mapping writes it, whichever form and letters it has; "" where it is none."""
    small = written.lower()
    if rate := _RATE.fullmatch(small):
        small = f"{_ALIASES.get(rate[1], rate[1])}/s"
    elif _ACCELERATION.fullmatch(small):
        small = "m/s²"
    return next((each for each in (_ALIASES.get(small, small), written) if _is_known(each)), "")


def _is_known(unit: str) -> bool:
    return unit in _OTHER_UNITS or any(unit in units for units in UNITS.values())
