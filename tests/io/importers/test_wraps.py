"""Columns that begin anew at the end of their range: counters of 32 bits, tilts and headings of one turn."""

import numpy as np
import pytest
import yaml
from foreign_logs import NAMES, columns, text

from twbal.core.channels import Channels
from twbal.core.episode import Provenance
from twbal.core.plant import Observation
from twbal.io.importers.all_columns import all_columns
from twbal.io.importers.checks.doubt import DoubtKind
from twbal.io.importers.conversion import Wanted, import_file
from twbal.io.importers.guess import guess
from twbal.io.importers.mapping import mapping
from twbal.io.importers.measured_columns import seconds_of, wheel_path
from twbal.io.importers.wraps import angle_wrap

ROWS = columns()
COLUMN = dict(zip(NAMES, ROWS.T, strict=True))
CHANNELS = Channels(("tilt", "tilt_rate", "speed", "command_1"), 0.1)
WANTED = Wanted(lambda period: CHANNELS, None, 50)
TURN = 2.0 * np.pi


@pytest.fixture
def looked_at(tmp_path):
    def look(**named):
        path = tmp_path / "log.csv"
        path.write_text(text(np.column_stack(list(named.values())), names=tuple(named)))
        return path

    return look


def exact(path, **named):
    """A text with all digits of whole numbers of 32 bits."""
    lines = [",".join(named), *(",".join(f"{x:.12g}" for x in row) for row in np.column_stack(list(named.values())))]
    path.write_text("\n".join(lines) + "\n")
    return path


def proposed(path):
    return yaml.safe_load(guess(path).mapping)["quantities"]


def imported(path, quantities):
    described = yaml.safe_load(guess(path).mapping) | {"quantities": quantities}
    del described["_target_"]
    return import_file(path, mapping(**described), WANTED, Provenance("mine", "robot"))


def seen(episode, name):
    return episode.observations[:, Observation._fields.index(name)]


@pytest.mark.parametrize("bits", [16, 32])
@pytest.mark.parametrize("name", ["enc_left", "wheel_angle"])
def test_negative_counts_that_are_printed_unsigned_wrap_by_their_bits(bits, name, tmp_path):
    counts = np.round(100 * COLUMN["wheel_angle"]) % 2**bits
    columns_of_it = {name: counts, "enc_right": counts} if name == "enc_left" else {name: counts}
    path = exact(
        tmp_path / "log.csv", time=COLUMN["time"], tilt=COLUMN["tilt"], torque=COLUMN["command"], **columns_of_it
    )
    told = proposed(path)["wheel_angle"]
    assert told["wraps"] == 2**bits and told["scale"] == "???"
    path_of_wheels = wheel_path(all_columns(path)).values
    assert np.abs(np.diff(path_of_wheels)).max() < 10


def test_the_range_is_that_of_the_jumps():
    counts = np.round(300 * COLUMN["wheel_angle"])
    assert angle_wrap(counts % 2**32, "rad") == 2**32
    assert angle_wrap(counts % 2**16, "rad") == 2**16
    assert angle_wrap(np.round(100 * COLUMN["wheel_angle"]) % 360, "deg") == 360
    assert angle_wrap(counts, "rad") is None


@pytest.mark.parametrize(("bits", "scale"), [(16, 0.01), (32, 0.01)])
def test_an_import_names_the_range_that_fits_the_jumps(bits, scale, tmp_path):
    counts = np.round(COLUMN["wheel_angle"] / scale) % 2**bits
    path = exact(tmp_path / "log.csv", time=COLUMN["time"], tilt=COLUMN["tilt"], torque=COLUMN["command"], enc=counts)
    quantities = proposed(path)
    quantities["wheel_angle"] = {"from": "enc", "unit": "rad", "scale": scale}
    found = imported(path, quantities)
    (doubt,) = (each for each in found.doubts if each.kind is DoubtKind.JUMP)
    assert f"++import.quantities.wheel_angle.wraps={2**bits}" in doubt.sentence and "enc" in doubt.sentence
    assert doubt.evidence is not None
    quantities["wheel_angle"]["wraps"] = 2**bits
    mended = imported(path, quantities)
    assert not any(each.kind is DoubtKind.JUMP for each in mended.doubts)
    assert np.abs(np.diff(seen(mended.episodes[0], "wheel_angle"))).max() < 0.2


def test_a_spike_alone_is_no_range(tmp_path):
    wheel = COLUMN["wheel_angle"].copy()
    wheel[200] += 50.0
    path = exact(
        tmp_path / "log.csv", time=COLUMN["time"], tilt=COLUMN["tilt"], torque=COLUMN["command"], wheel_angle=wheel
    )
    found = imported(path, proposed(path))
    assert not any(".wraps=" in each.sentence for each in found.doubts)


TILTS = {
    "0 to 360": (lambda tilt: tilt % 360, 0.0),
    "0 to 360, first below": (lambda tilt: (tilt - 1.0) % 360, 0.0),
    "180 from upright": (lambda tilt: (tilt + 180 + 180) % 360 - 180, -np.pi),
}


@pytest.mark.parametrize("name", ["pitch_deg", "pitch [°]", "pitch"])
@pytest.mark.parametrize("kind", TILTS)
def test_a_tilt_of_one_turn_is_unwrapped_and_counted_from_upright(kind, name, looked_at):
    degrees = np.degrees(COLUMN["tilt"])
    turned, offset = TILTS[kind][0](degrees), TILTS[kind][1]
    path = looked_at(time=COLUMN["time"], **{name: turned}, wheel_angle=COLUMN["wheel_angle"], torque=COLUMN["command"])
    told = proposed(path)["tilt"]
    assert told["wraps"] == 360 and told["unit"] in ("deg", "°")
    assert told.get("offset", 0.0) == pytest.approx(offset, abs=1e-5)
    (episode,) = imported(path, proposed(path)).episodes
    expected = COLUMN["tilt"] - (np.radians(1.0) if "below" in kind else 0.0)
    assert seen(episode, "tilt") == pytest.approx(expected, abs=1e-5)


def test_a_tilt_in_radians_that_jumps_by_a_turn_is_no_tilt_in_degrees(looked_at):
    path = looked_at(time=COLUMN["time"], pitch=COLUMN["tilt"] % TURN, wheel_angle=COLUMN["wheel_angle"])
    found = guess(path)
    told = yaml.safe_load(found.mapping)["quantities"]["tilt"]
    assert told["unit"] == "rad" and told["wraps"] == pytest.approx(TURN) and "tilt" not in found.unknown_units


def test_a_tilt_that_does_not_jump_has_neither_range_nor_offset(looked_at):
    told = proposed(
        looked_at(time=COLUMN["time"], pitch_deg=np.degrees(COLUMN["tilt"]), wheel_angle=COLUMN["wheel_angle"])
    )
    assert told["tilt"] == {"from": "pitch_deg", "unit": "deg"}


def test_the_unit_of_a_gyro_is_told_by_a_tilt_that_wraps(looked_at):
    path = looked_at(
        time=COLUMN["time"], pitch_deg=np.degrees(COLUMN["tilt"]) % 360, gyro_y=np.degrees(COLUMN["tilt_rate"]),
        wheel_angle=COLUMN["wheel_angle"],
    )  # fmt: skip
    assert proposed(path)["tilt_rate"] == {"from": "gyro_y", "unit": "deg/s"}
    assert seconds_of(all_columns(path)) == pytest.approx(COLUMN["time"])


@pytest.mark.parametrize("name", ["yaw_deg", "heading_deg", "yaw"])
def test_a_heading_of_one_turn_has_its_range(name, looked_at):
    heading = np.degrees(4.0 * COLUMN["time"])
    path = looked_at(
        time=COLUMN["time"], tilt=COLUMN["tilt"], wheel_angle=COLUMN["wheel_angle"],
        **{name: (heading + 180) % 360 - 180},
    )  # fmt: skip
    told = proposed(path)["heading"]
    assert told["wraps"] == 360 and told["unit"] == "deg" and "offset" not in told
