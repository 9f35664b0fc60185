"""Numbers with units as people write them: `1090 g`, `7.6 cm`, `8.5 kg·cm`, `100 Hz`, `1/60`."""

import re
from collections.abc import Mapping
from math import inf, isfinite, pi

from twbal.core.errors import ConfigError

_ANGLE = {"rad": 1.0, "mrad": 1e-3, "deg": pi / 180.0, "°": pi / 180.0}
_TORQUE = {"N·m": 1.0, "mN·m": 1e-3, "N·cm": 1e-2, "kg·cm": 0.0980665, "kgf·cm": 0.0980665, "oz·in": 0.00706155}
_INERTIA = {"kg·m²": 1.0, "g·cm²": 1e-7, "kg·cm²": 1e-4, "g·m²": 1e-3, "g·mm²": 1e-9, "kg·mm²": 1e-6}

UNITS: Mapping[str, Mapping[str, float]] = {
    "kg": {"kg": 1.0, "g": 1e-3},
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254},
    "s": {"s": 1.0, "ms": 1e-3, "µs": 1e-6},
    "rad": _ANGLE,
    "N·m": _TORQUE,
    "kg·m²": _INERTIA,
    "V": {"V": 1.0, "mV": 1e-3},
    "ohm": {"ohm": 1.0, "Ω": 1.0, "mohm": 1e-3},
    "N·m/A": {"N·m/A": 1.0, "mN·m/A": 1e-3, "V·s/rad": 1.0},
    "": {},
}
"""Factor to the SI unit, by that unit and by each unit that is understood in its place."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_DIVISOR = re.compile(r"\s*/\s*(\d+\.?\d*|\.\d+)(?![\d.])")
_THOUSANDS = 1000.0  # from this number on an inertia is most often in g·cm², as CAD programs and data sheets have it
_FREQUENCY = {"hz": 1.0, "khz": 1e3}


def quantity(text: str, unit: str) -> tuple[float, bool]:
    """The number that a text says, in the SI unit `unit`, and whether the text named a unit.

    Raises:
        ConfigError: it is no number, or has a unit of something else.
    """
    number = _NUMBER.match(text.strip())
    if number is None:
        raise ConfigError(f"{text!r} is no number; expected one such as 0.25{_example(unit)}.")
    rest = text.strip()[number.end() :].strip()
    if rest[:1] == ",":
        raise ConfigError(f"{text!r} has a comma; expected is a point: {text.replace(',', '.')!r}.")
    value = float(number[0])
    if divisor := _DIVISOR.match(rest):
        value, rest = value / float(divisor[1]) if float(divisor[1]) else inf, rest[divisor.end() :].strip()
    if not isfinite(value):
        raise ConfigError(f"{text!r} is no finite number.")
    if not rest:
        return value, False
    if unit == "s" and _plain(rest) in _FREQUENCY and value > 0:
        return 1.0 / (value * _FREQUENCY[_plain(rest)]), True
    factors = {_plain(name): factor for name, factor in UNITS[unit].items()}
    if _plain(rest) not in factors:
        known = ", ".join(UNITS[unit]) + (", Hz" if unit == "s" else "")
        expected = f"one of: {known}" if known else "none, as it is a plain number"
        raise ConfigError(f"{text!r} has the unit {rest!r}; expected {expected}.")
    return value * factors[_plain(rest)], True


def meant(value: float, unit: str, low: float, high: float) -> list[str]:
    """The units in which a number without one would lie within a range, nearest to its geometric middle first.

    Of inertias in the thousands g·cm² is the first.
    """
    sizes = {name: abs(value) * factor for name, factor in UNITS[unit].items() if factor != 1.0}
    if unit == "s" and value > 0:
        sizes["Hz"] = 1.0 / value
    middle = (max(low, high * 1e-6) * high) ** 0.5
    fitting = [name for name, size in sizes.items() if low <= size <= high]
    first = "g·cm²" if abs(value) >= _THOUSANDS else ""
    return sorted(fitting, key=lambda name: (name != first, max(sizes[name] / middle, middle / sizes[name])))


def _plain(unit: str) -> str:
    """A unit however it was typed: kg m2, kg*m^2 and kg·m² are one."""
    return re.sub(r"[\s·*.^-]", "", unit).replace("²", "2").replace("μ", "µ").lower().replace("us", "µs")


def _example(unit: str) -> str:
    return f" or 0.25 {unit}" if unit else ""
