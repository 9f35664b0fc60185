"""Numbers with units, against definitions of the units."""

from math import radians

import pytest

from twbal.core.errors import ConfigError
from twbal.sheets.units import meant, quantity


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("1090 g", "kg", 1.09),
        ("1090g", "kg", 1.09),
        ("76mm", "m", 0.076),
        ("2 in", "m", 0.0508),
        ("100 Hz", "s", 0.01),
        ("10 ms", "s", 0.01),
        ("-2 deg", "rad", radians(-2)),
        ("1 kg·cm", "N·m", 9.80665 * 0.01),  # of the kilogram-force
        ("1 kgf cm", "N·m", 9.80665 * 0.01),
        ("16 oz in", "N·m", 0.45359237 * 9.80665 * 0.0254),
        ("1 g·cm²", "kg·m²", 1e-3 * 1e-2**2),
        ("1 g cm2", "kg·m²", 1e-3 * 1e-2**2),
        ("1 kg*m^2", "kg·m²", 1.0),
        ("1.65 Ω", "ohm", 1.65),
        ("110.1", "", 110.1),
    ],
)
def test_a_unit_is_what_it_is_defined_as_however_it_is_typed(text, unit, value):
    found, has_unit = quantity(text, unit)
    assert found == pytest.approx(value, rel=1e-5)
    assert has_unit == (unit != "")


@pytest.mark.parametrize(
    ("text", "unit", "said"),
    [
        ("2,6", "m", "expected is a point: '2.6'"),
        ("76 kg", "m", "has the unit 'kg'; expected one of: m, mm, cm, in"),
        ("five", "m", "is no number; expected one such as 0.25 or 0.25 m"),
        ("", "m", "is no number"),
        ("1e999", "m", "is no finite number"),
        ("1/0", "s", "is no finite number"),
        ("1/60/2", "s", "has the unit '/2'"),
        ("110:1", "", "expected none, as it is a plain number"),
    ],
)
def test_what_is_no_such_quantity_is_told(text, unit, said):
    with pytest.raises(ConfigError, match=said):
        quantity(text, unit)


def test_the_likeliest_unit_of_a_slip_comes_first():
    assert meant(76.0, "m", 0.004, 2.0)[0] == "mm"
    assert meant(100.0, "s", 0.001, 0.1)[0] in ("Hz", "ms")
    assert meant(0.0, "m", 0.004, 2.0) == []


@pytest.mark.parametrize(("text", "value"), [("1/60", 1 / 60), ("1/60 s", 1 / 60), ("1000 / 70 ms", 1 / 70)])
def test_a_fraction_is_a_number(text, value):
    assert quantity(text, "s")[0] == pytest.approx(value, rel=1e-12)


def test_an_inertia_in_the_thousands_is_taken_for_one_in_g_cm2_first():
    assert meant(2000.0, "kg·m²", 1e-7, 1.0)[0] == "g·cm²"
    assert meant(60.0, "kg·m²", 1e-6, 30.0)[0] != "g·cm²"
