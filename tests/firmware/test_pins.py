"""The ESP32's pins: none is used twice, none drives a motor while the board boots, and the guide says the same ones."""

import re

import pytest
from building import FIRMWARE

AT_BOOT = {0, 1, 2, 3, 5, 12, 14, 15}
"""Of the ESP32: they decide how it boots, have a pull-up after a reset, or are the line (its data sheet)."""
FLASH, INPUTS = set(range(6, 12)), set(range(34, 40))
MOTORS = [f"{side}_{what}" for side in ("LEFT", "RIGHT") for what in ("PWM", "IN1", "IN2")] + ["STANDBY"]
ROWS = {
    "SDA, SCL": ["SDA_PIN", "SCL_PIN"],
    "PWMA, AIN1, AIN2 (ENA, IN1, IN2)": MOTORS[:3],
    "PWMB, BIN1, BIN2 (ENB, IN3, IN4)": MOTORS[3:6],
    "STBY": ["STANDBY"],
}


@pytest.fixture(scope="module")
def pins():
    text = (FIRMWARE / "boards" / "esp32" / "robot_config.h").read_text()
    lines = re.findall(r"^static const int ([^;]+);", text, flags=re.MULTILINE)
    found = {name: int(pin) for line in lines for name, pin in re.findall(r"(\w+) = (-?\d+)", line)}
    return {name: pin for name, pin in found.items() if not name.endswith("_AXIS")}


def test_no_pin_is_used_twice(pins):
    used = [pin for pin in pins.values() if pin >= 0]
    assert len(used) == len(set(used)) == 13
    assert not FLASH.intersection(used)


def test_no_motor_is_at_a_pin_that_is_driven_while_the_board_boots(pins):
    assert not (AT_BOOT | INPUTS).intersection(pins[name] for name in MOTORS)


def test_the_guide_wires_the_same_pins(pins):
    page = (FIRMWARE.parent / "docs" / "firmware.md").read_text()
    for row, names in ROWS.items():
        (said,) = re.findall(rf"^\| [^|]*\| {re.escape(row)} \| ([\d, ]+)", page, flags=re.MULTILINE)
        assert [int(pin) for pin in said.split(",")] == [pins[name] for name in names]
    encoders = re.findall(r"^\| (left|right) encoder \| A, B; VCC, GND \| (\d+), (\d+);", page, flags=re.MULTILINE)
    assert {(side.upper(), int(a), int(b)) for side, a, b in encoders} == {
        (side, pins[f"{side}_A"], pins[f"{side}_B"]) for side in ("LEFT", "RIGHT")
    }
