"""Foreign logs into episodes: units, signs, gaps, what was not measured, and what looks wrong."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from foreign_logs import NAMES, PERIOD, columns, text
from hydra import compose
from hydra.utils import instantiate

from twbal.cli.composition import composing
from twbal.core.channels import Channels
from twbal.core.episode import Provenance
from twbal.core.errors import ConfigError, LogError
from twbal.core.plant import Observation
from twbal.io.importers.conversion import Wanted, import_file
from twbal.io.importers.duplicates import duplicated
from twbal.io.importers.formats import formats

RADIUS = 0.1
CHANNELS = Channels(("tilt", "tilt_rate", "speed", "command_1"), RADIUS)
SOURCE = Provenance("mine", "robot")
ROWS = columns()


def mapping(*overrides):
    with composing():
        words = [f"++{word}" if word.startswith("import.quantities") else word for word in overrides]
        cfg = compose("import_log", ["files=x", *words])
        return instantiate(cfg["import"], _convert_="all")


@pytest.fixture
def brought(tmp_path):
    def bring(rows, *overrides, names=NAMES, period=None, min_length=50):
        path = tmp_path / "log.csv"
        path.write_text(text(rows, names=names))
        return import_file(path, mapping(*overrides), Wanted(lambda period: CHANNELS, period, min_length), SOURCE)

    return bring


def seen(episode, name):
    return episode.observations[:, Observation._fields.index(name)]


def sentences(imported):
    return [doubt.sentence for doubt in imported.doubts]


def only(imported):
    (episode,) = imported.episodes
    return episode


def test_every_quantity_lands_in_its_channel(brought):
    imported = brought(ROWS)
    episode = only(imported)
    assert episode.control_period == pytest.approx(PERIOD)
    for name in NAMES[:-1]:
        assert seen(episode, name) == pytest.approx(ROWS[:, NAMES.index(name)], abs=1e-8)
    assert episode.commands == pytest.approx(ROWS[:-1, -1], abs=1e-8)
    assert episode.estimated == ()
    speed = RADIUS * (ROWS[:, 6] + ROWS[:, 2])
    assert episode.states[:, 2] == pytest.approx(speed, abs=1e-8)
    assert episode.states[1:, 3] == pytest.approx(ROWS[:-1, -1], abs=1e-8)


def test_a_log_without_tilt_is_one_of_its_gyro_and_says_what_it_does_not_tell(brought):
    imported = brought(ROWS, "import.quantities.tilt=null")
    episode = only(imported)
    assert {e.channel for e in episode.estimated} == {"tilt"}
    trend = np.polyval(np.polyfit(ROWS[:, 0], ROWS[:, 1], 1), ROWS[:, 0])
    assert episode.tilt == pytest.approx(ROWS[:, 1] - trend, abs=1e-4)
    assert "the log has no tilt: its mean" in " ".join(imported.notes)
    assert not any(
        "tilt" in sentence and "does not follow" in sentence for sentence in (*sentences(imported), *imported.untold)
    )


def test_a_log_without_tilt_may_have_a_row_between_two_gaps(brought):
    rows = columns(600)
    rows[300:, 0] += 1.0
    rows[301:, 0] += 1.0
    imported = brought(rows, "import.quantities.tilt=null")
    assert [len(episode.observations) for episode in imported.episodes] == [300, 299]
    assert "1 part without a gap of at most 1 samples: too short, left out" in imported.notes


def test_what_is_skipped_of_a_log_without_tilt_leaves_the_rest_as_it_is(brought):
    carried = ROWS.copy()
    carried[:100, 2] += 3.0
    rest = ROWS[100:, 1] - np.polyval(np.polyfit(ROWS[100:, 0], ROWS[100:, 1], 1), ROWS[100:, 0])
    episode = only(brought(carried, "import.quantities.tilt=null", "import.skip=1"))
    assert episode.tilt == pytest.approx(rest, abs=1e-4)


def test_rows_of_a_log_without_tilt_that_come_twice_are_seen(brought):
    rng = np.random.default_rng(5)
    noisy = ROWS + np.round(0.01 * rng.standard_normal(ROWS.shape), 4) * (np.arange(8) > 0)
    again = np.concatenate([noisy[:200], noisy])
    again[:, 0] = PERIOD * np.arange(len(again))
    assert any("come again" in said for said in sentences(brought(again, "import.quantities.tilt=null")))


def test_stamps_in_bunches_become_those_of_an_even_loop_with_a_sentence(brought):
    rows = ROWS.copy()
    rows[:, 0] = np.round(ROWS[4::5, 0].repeat(5) + 0.0001 * np.tile(np.arange(5), len(ROWS) // 5) + 20.0, 4)
    imported = brought(rows)
    episode = only(imported)
    assert episode.control_period == pytest.approx(PERIOD) and len(episode.observations) == len(ROWS)
    assert seen(episode, "time") == pytest.approx(PERIOD * np.arange(len(ROWS)), abs=1e-8)
    assert "time stamps come in bunches of about 5 rows" in " ".join(imported.notes)
    assert sentences(imported) == sentences(brought(ROWS))


def test_a_quantity_that_the_mapping_says_nothing_of_is_no_fault_of_the_log(brought):
    names = ("time", "tilt", "gyro", *NAMES[3:])
    with pytest.raises(
        LogError, match=r"The mapping does not say where tilt_rate is: .* write tilt_rate: null"
    ) as said:
        brought(ROWS, names=names)
    assert "has no column 'tilt_rate'; it has: time, tilt, gyro" in str(said.value)
    with pytest.raises(LogError, match=r"has no column 'gyr'.* Mend the mapping") as said:
        brought(ROWS, "import.quantities.tilt_rate={from:gyr}", names=names)
    assert "does not say where" not in str(said.value)


def test_units_signs_means_and_offsets(brought):
    rows = np.column_stack(
        [1e3 * ROWS[:, 0], -np.degrees(ROWS[:, 1]) + 2, ROWS[:, 5] - 0.2, ROWS[:, 5] + 0.2, ROWS[:, 7]]
    )
    episode = only(
        brought(
            rows,
            "import.quantities={time:{from:ms,unit:ms},tilt:{from:lean,unit:deg,scale:-1,offset:0.034906585},"
            "tilt_rate:null,acceleration:null,yaw_rate:null,wheel_angle:{from:[left,right]},wheel_rate:null,"
            "command:{from:u,scale:2}}",
            names=("ms", "lean", "left", "right", "u"),
        )
    )
    assert seen(episode, "tilt") == pytest.approx(ROWS[:, 1], abs=1e-8)
    assert seen(episode, "wheel_angle") == pytest.approx(ROWS[:, 5], abs=1e-7)
    assert episode.commands == pytest.approx(2 * ROWS[:-1, 7], abs=1e-7)


def test_what_was_not_measured_is_worked_out_and_said_to_be(brought):
    rng = np.random.default_rng(0)
    noisy = ROWS + np.array([0, 1e-3, 0, 0, 0, 5e-3, 0, 0]) * rng.standard_normal(ROWS.shape)
    gone = "import.quantities={tilt_rate:null,acceleration:null,yaw_rate:null,wheel_rate:null}"
    imported = brought(noisy, gone)
    episode = only(imported)
    doubt = dict(episode.estimated)
    assert set(doubt) == {"tilt_rate", "acceleration", "yaw_rate", "wheel_rate"}
    for name in ("tilt_rate", "wheel_rate"):
        error = np.std(seen(episode, name) - ROWS[:, NAMES.index(name)])
        assert 0.3 < error / doubt[name] < 3.0
    assert any("worked out" in note for note in imported.notes)


def test_a_voltage_becomes_the_torque_of_a_motor_that_stands_still(brought):
    motor = "{_target_:twbal.core.motor.Motor,resistance:2.0,torque_constant:0.02,gear:10,supply:6}"
    quantities = "import.quantities={command:null,voltage:{from:command,scale:10}}"
    episode = only(brought(ROWS, quantities, f"import.motor={motor}"))
    assert episode.commands == pytest.approx(0.1 * np.clip(10 * ROWS[:-1, 7], -6, 6), abs=1e-7)


def test_a_duty_cycle_in_percent_is_that_share_of_the_supply(brought):
    motor = "{_target_:twbal.core.motor.Motor,resistance:2.0,torque_constant:0.02,gear:10,supply:6}"
    quantities = "import.quantities={command:null,voltage:{from:command,unit:'%',scale:-50}}"
    episode = only(brought(ROWS, quantities, f"import.motor={motor}"))
    assert episode.commands == pytest.approx(-0.1 * 6 * 0.5 * ROWS[:-1, 7], abs=1e-7)


def test_a_command_that_is_a_sample_is_the_mean_of_two(brought):
    episode = only(brought(ROWS, "import.command_is_sample=true"))
    assert episode.commands == pytest.approx(0.5 * (ROWS[1:, 7] + ROWS[:-1, 7]), abs=1e-7)


def test_a_pose_gives_the_way_whatever_the_heading(brought):
    way = RADIUS * ROWS[:, 5]
    heading = 0.7 + 0.3 * np.sin(ROWS[:, 0])
    steps = np.diff(way)
    middle = 0.5 * (heading[1:] + heading[:-1])
    x, y = (np.concatenate([[0], np.cumsum(steps * part)]) for part in (np.cos(middle), np.sin(middle)))
    rows = np.column_stack([ROWS[:, 0], ROWS[:, 1], x, y, heading, ROWS[:, 7]])
    sources = (
        "import.quantities={x:{from:x},y:{from:y},heading:{from:h},wheel_angle:null,wheel_rate:null,tilt_rate:null,"
    )
    imported = brought(
        rows, sources + "acceleration:null,yaw_rate:null}", names=("time", "tilt", "x", "y", "h", "command")
    )
    episode = only(imported)
    assert seen(episode, "wheel_angle") == pytest.approx(ROWS[:, 5] - ROWS[0, 5], abs=1e-6)
    turning = 0.3 * np.cos(ROWS[:, 0])
    assert np.std(seen(episode, "yaw_rate") - turning) < 0.02


def test_rows_out_of_order_are_an_error_that_says_so(brought):
    order = np.arange(len(ROWS))
    order[10:-10:20], order[11:-9:20] = order[11:-9:20].copy(), order[10:-10:20].copy()
    with pytest.raises(LogError, match=r"time runs backwards 19 times, .* were they swapped\? Sort the file by"):
        brought(ROWS[order])


def test_a_scale_that_is_no_number_is_an_error_of_the_mapping(brought):
    with pytest.raises(Exception, match="The scale and the offset of tilt are to be numbers; found None"):
        mapping("import.quantities.tilt={from:tilt,scale:null}")


@pytest.mark.parametrize(
    ("lies", "advice"),
    [
        (slice(0, 50), "give import.skip=0.5"),
        (slice(200, 250), "cut the file there into two"),
        (slice(50, 60), None),  # single faulty samples
        (slice(360, 400), None),  # it falls at the end, where later stages end, too
    ],
)
def test_a_robot_that_lies_before_it_balances_is_warned_of(lies, advice, brought):
    rows = ROWS.copy()
    rows[lies, 1] = 1.3
    found = [sentence for sentence in sentences(brought(rows)) if "the robot lies or is held for" in sentence]
    assert len(found) == (advice is not None)
    assert advice is None or found[0].endswith(advice)


def test_what_was_worked_out_is_said_once_for_all_recordings(brought):
    rows = np.concatenate([ROWS, np.random.default_rng(0).normal(1.0, 0.01, ROWS.shape) * ROWS + [9, *[0] * 7]])
    gone = "import.quantities={tilt_rate:null,acceleration:null,wheel_rate:null}"
    imported = brought(rows[np.argsort(rows[:, 0])], gone)
    (note,) = (note for note in imported.notes if "worked out" in note)
    assert len(imported.episodes) > 1
    assert note.count("tilt_rate (to") == note.count("wheel_rate (to") == note.count("acceleration (to") == 1


def test_a_header_again_needs_a_column_of_time(brought, tmp_path):
    """Else nothing tells whether a recording goes on."""
    (tmp_path / "log.csv").write_text(text(ROWS[:200, 1:], names=NAMES[1:]) + text(ROWS[200:, 1:], names=NAMES[1:]))
    of_rate = mapping("import.quantities={time:null}", "import.rate=100")
    with pytest.raises(LogError, match=r"Line 202 of .* is its header again, and without a column of time"):
        import_file(tmp_path / "log.csv", of_rate, Wanted(lambda period: CHANNELS, None, 50), SOURCE)


def test_a_rate_stands_in_for_time(brought):
    rows = ROWS[:, 1:]
    episode = only(brought(rows, "import.quantities={time:null}", "import.rate=100", names=NAMES[1:]))
    assert seen(episode, "time") == pytest.approx(ROWS[:, 0])


def test_a_longer_period_takes_the_mean_command(brought):
    episode = only(brought(ROWS, period=4 * PERIOD))
    assert episode.control_period == pytest.approx(4 * PERIOD)
    assert seen(episode, "tilt") == pytest.approx(ROWS[::4, 1], abs=1e-8)
    assert episode.commands == pytest.approx(ROWS[: 4 * len(episode), 7].reshape(-1, 4).mean(axis=1), abs=1e-7)
    with pytest.raises(LogError, match="no multiple"):
        brought(ROWS, period=0.015)


def test_gaps_part_a_recording_and_small_ones_are_filled(brought):
    kept = np.ones(len(ROWS), bool)
    kept[100:102] = False
    kept[200:230] = False
    imported = brought(ROWS[kept])
    assert [len(episode) for episode in imported.episodes] == [197, 169]
    first = imported.episodes[0]
    assert seen(first, "tilt") == pytest.approx(ROWS[:200][kept[:200], 1], abs=1e-8)
    assert seen(first, "time") == pytest.approx(ROWS[:200][kept[:200], 0] - ROWS[0, 0], abs=1e-6)
    assert first.commands == pytest.approx(ROWS[:199][kept[:199], 7], abs=1e-8)
    assert len(first.states) == 198
    said = " ".join(imported.notes)
    assert "2 missing samples are left out" in said
    assert "30 samples are missing before line 200" in said


def test_many_missing_samples_are_interpolated_as_no_diagnosis_takes_them_else(brought):
    kept = np.arange(len(ROWS)) % 9 != 5
    imported = brought(ROWS[kept])
    (episode,) = imported.episodes
    assert len(episode) == len(ROWS) - 1
    assert seen(episode, "tilt") == pytest.approx(ROWS[:, 1], abs=1e-3)
    assert "missing samples are interpolated, as they are many" in " ".join(imported.notes)


def test_repeated_rows_backward_time_and_nan_are_handled_and_said(brought):
    rows = np.concatenate([ROWS[:150], ROWS[149:150], ROWS[150:], ROWS])
    rows[20, 1] = np.nan
    imported = brought(rows)
    assert [len(episode) for episode in imported.episodes] == [len(ROWS) - 2, len(ROWS) - 1]
    said = " ".join(imported.notes)
    assert "1 row with an empty field, NaN, infinity or more than 1e+30 is left out, the first in line 22" in said
    assert "1 row that repeats the one before is left out" in said
    assert f"time runs backwards before line {len(ROWS) + 3}" in said
    pair = list(duplicated(imported.episodes, ["a", "b"]))
    assert len(pair) == 1
    assert "in common" in pair[0]


def test_a_heading_that_wraps_is_one_that_turns_on(brought):
    """Once round a circle at 0.5 m/s, with a heading in (-π, π]; one row is lost at the wrap."""
    time = 0.02 * np.arange(400)
    heading = 2.0 * np.pi * time / time[-1]
    radius = 0.5 * time[-1] / (2.0 * np.pi)
    rows = np.column_stack(
        [time, 0.01 * np.sin(time), radius * np.sin(heading), -radius * np.cos(heading), heading, np.sin(time)]
    )
    rows[:, 4] = np.angle(np.exp(1j * rows[:, 4]))
    lost = int(np.argmin(np.diff(rows[:, 4])))
    sources = [f"import.quantities.{name}=null" for name in ("tilt_rate", "acceleration", "wheel_angle", "wheel_rate")]
    sources += [f"import.quantities.{name}={{from:{name},unit:{unit}}}" for name, unit in (("x", "m"), ("y", "m"))]
    sources += ["import.quantities.heading={from:heading,unit:rad}", "import.quantities.yaw_rate=null"]
    names = ("time", "tilt", "x", "y", "heading", "command")
    episode = only(brought(np.delete(rows, lost, axis=0), *sources, names=names))
    assert seen(episode, "wheel_angle")[-1] * RADIUS == pytest.approx(0.5 * time[-1], rel=2e-3)
    assert np.diff(seen(episode, "wheel_angle")).min() > 0


@pytest.mark.parametrize("between", ["\n", "# event\n"])
def test_lines_that_are_no_rows_are_no_samples(between, brought, tmp_path):
    brought(ROWS)
    lines = (tmp_path / "log.csv").read_text().splitlines(keepends=True)
    (tmp_path / "log.csv").write_text("".join([*lines[:90], between, *lines[90:200], between, between, *lines[200:]]))
    chosen = mapping("import.quantities.time=null", f"import.rate={1 / PERIOD}")
    found = import_file(tmp_path / "log.csv", chosen, Wanted(lambda period: CHANNELS, None, 50), SOURCE)
    np.testing.assert_allclose(np.diff(seen(only(found), "time")), PERIOD)
    assert not any("missing" in note for note in found.notes)


def test_sensors_that_are_logged_in_different_rows_are_told_to_be(brought):
    rows = ROWS.copy()
    rows[::2, NAMES.index("tilt")] = np.nan
    rows[1::2, NAMES.index("wheel_angle")] = np.nan
    with pytest.raises(LogError, match="its sensors are logged in different rows"):
        brought(rows)


def test_a_column_without_any_number_is_named_with_its_quantity(brought):
    rows = ROWS.copy()
    rows[:, NAMES.index("tilt")] = np.nan
    said = r"column 'tilt' \(tilt\) has none in any row.*import\.quantities\.tilt=null"
    with pytest.raises(LogError, match=said) as caught:
        brought(rows)
    assert "column 2" not in str(caught.value)
    rows[:, NAMES.index("wheel_rate")] = np.inf
    with pytest.raises(LogError, match=r"columns 'tilt' \(tilt\), 7 \(wheel_rate\) have none in any row"):
        brought(rows, "import.quantities.wheel_rate={from:7}")


def test_a_skip_beyond_the_log_is_named_as_what_leaves_nothing(brought):
    said = r"of which the first 20 s are skipped: too short.* the longest has 3\.99 s: give a smaller import\.skip"
    with pytest.raises(LogError, match=said) as caught:
        brought(ROWS, "import.skip=20")
    assert "Is the rate right" not in str(caught.value)
    with pytest.raises(LogError, match=r"at most 30 samples: too short, left out\. Is the rate right"):
        brought(ROWS[:30])
    parted = np.concatenate([ROWS[:300], ROWS[350:]])
    imported = brought(parted, "import.skip=1")
    assert "1 part without a gap of at most 50 samples, of which the first 1 s are skipped: too short, left out" in (
        imported.notes
    )


def test_many_short_parts_are_one_line(brought):
    keep = np.ones(len(ROWS), bool)
    keep[100:] = np.arange(300) % 10 < 2  # two samples, then eight missing
    imported = brought(ROWS[keep])
    assert len(imported.episodes) == 1
    (said,) = [note for note in imported.notes if "too short" in note]
    assert said.startswith("29 parts without a gap of at most 2 samples: too short")


def test_a_rows_command_acts_after_its_sample_or_before_it_where_the_mapping_says_so(brought):
    """A mass whose speed says which command acted when: speed[t + 1] = speed[t] + period command[t]."""
    commands = np.random.default_rng(1).standard_normal(300)
    speed = np.concatenate([[0.0], np.cumsum(PERIOD * commands)])
    rows = ROWS[:301].copy()
    rows[:, NAMES.index("wheel_rate")] = speed
    for key, logged in (("false", np.append(commands, 0.0)), ("true", np.append(0.0, commands))):
        rows[:, -1] = logged
        episode = only(brought(rows, f"import.command_before_sample={key}"))
        assert np.diff(seen(episode, "wheel_rate")) == pytest.approx(PERIOD * episode.commands, abs=1e-7)


def test_the_last_row_needs_no_command(brought):
    rows = ROWS.copy()
    rows[-1, -1] = np.nan
    episode = only(brought(rows))
    assert len(episode) == len(ROWS) - 1
    assert episode.commands == pytest.approx(ROWS[:-1, -1], abs=1e-8)
    assert len(only(brought(rows, "import.command_before_sample=true"))) == len(ROWS) - 2


@pytest.mark.parametrize("digits", [9, 3])
def test_a_rate_that_is_no_whole_number_of_milliseconds_keeps_its_period(digits, brought):
    rows = columns(1000)
    rows[:, 0] = np.round(np.arange(1000) / 70, digits)
    assert only(brought(rows)).control_period == 1 / 70
    assert only(brought(rows, period=2 / 70)).control_period == pytest.approx(1 / 35, abs=1e-15)


def test_the_period_of_a_loop_that_is_late_now_and_then_is_its_mean(brought):
    rng = np.random.default_rng(0)
    steps = 0.03 + 0.002 * (rng.random(999) < 0.5)
    rows = columns(1000)
    rows[:, 0] = np.concatenate([[0.0], np.cumsum(steps)])
    assert only(brought(rows)).control_period == pytest.approx(0.031, rel=2e-3)


def test_logs_of_a_loop_that_is_not_quite_even_take_the_period_that_is_asked_for(brought):
    rows = columns()
    rows[:, 0] = 0.0309 * np.arange(len(rows))
    assert only(brought(rows, period=0.031)).control_period == 0.031
    assert only(brought(rows, period=0.0312)).control_period == pytest.approx(0.0309)


def test_a_period_that_was_worked_out_is_kept_to_the_last_digit(brought):
    rows = columns()
    rows[:, 0] = 0.0123456 * np.arange(len(rows))
    assert only(brought(rows)).control_period == pytest.approx(0.0123456, rel=1e-8)


@pytest.mark.parametrize("jitter", [0.006, 0.02])
def test_stamps_that_jitter_are_said_to_with_what_to_try(jitter, brought):
    rng = np.random.default_rng(0)
    rows = columns()
    rows[:, 0] = 0.02 * np.arange(len(rows)) + jitter * rng.standard_normal(len(rows))
    try:
        said = " ".join(sentences(brought(rows)))
    except LogError as error:
        said = str(error)
    assert "++import.quantities.time=null import.rate=" in said
    words = said.split("leave the stamps out: ")[1].split()[:2]
    (even,) = brought(rows, words[0].removeprefix("++"), words[1]).episodes
    assert even.control_period == pytest.approx(0.02, rel=0.2)
    assert len(even) == len(rows) - 1


def test_time_that_is_no_time_is_refused(brought):
    rows = ROWS.copy()
    rows[:, 0] = np.random.default_rng(0).permutation(rows[:, 0])
    with pytest.raises(LogError, match=r"time runs backwards \d+ times, first in line"):
        brought(rows)
    rows[:, 0] = 1.0
    with pytest.raises(LogError, match="no two samples between which time runs forward"):
        brought(rows)
    with pytest.raises(LogError, match="no recording of 50 samples"):
        brought(ROWS[:20])


@pytest.mark.parametrize(("unit", "found"), [("s", "10 s"), ("us", "1e-05 s")])
def test_milliseconds_that_are_taken_for_another_unit_are_refused(unit, found, brought):
    rows = ROWS.copy()
    rows[:, 0] = 10.0 * np.arange(len(rows))
    assert only(brought(rows, "import.quantities.time.unit=ms")).control_period == pytest.approx(0.01)
    with pytest.raises(LogError, match=f"a sample every {found}; expected is .*Is the unit of the time right?"):
        brought(rows, f"import.quantities.time.unit={unit}")


def ride(seconds=20.0, braking=0.0, wheel_gain=0.02, return_gain=0.0, noise=0.2):
    """A pendulum on wheels under a regulator, by its own equations: signs are those of mechanics.

    Args:
        seconds: of the ride.
        braking: friction and back-EMF, torque for a turning rate of the wheels [N·m·s/rad].
        wheel_gain: of the regulator, on the turning rate of the wheels.
        return_gain: of the regulator, on their angle.
        noise: standard deviation of what is added to the command [N·m].
    """
    rng, dt = np.random.default_rng(3), PERIOD
    tilt = rate = wheel = wheel_rate = 0.0
    rows = []
    for k in range(round(seconds / dt)):
        u = 12 * tilt + 2 * rate + wheel_gain * (wheel_rate + rate) + return_gain * wheel
        u += 0.3 * np.sin(2.1 * k * dt) + noise * rng.standard_normal()
        rows.append([k * dt, tilt, rate, 0.0, 0.01 * rng.standard_normal(), wheel, wheel_rate, u])
        torque = u - braking * wheel_rate
        rate, spin = rate + dt * (20 * tilt - 8 * torque), wheel_rate + rate + dt * (20 * torque - 15 * tilt)
        tilt, wheel_rate = tilt + dt * rate, spin - rate
        wheel += dt * wheel_rate
    return np.array(rows)


WRONG = {
    "command seems to have the wrong sign": ("command", -1.0),
    "tilt_rate runs against tilt": ("tilt_rate", -1.0),
    "wheel_rate is .* times as fast as wheel_angle": ("wheel_rate", 57.3),
    "yaw_rate is 0 throughout": ("yaw_rate", 0.0),
    "the robot lies": ("tilt", 40.0),
}


@pytest.mark.parametrize("doubt", WRONG)
def test_what_looks_wrong_is_said(doubt, brought):
    name, factor = WRONG[doubt]
    rows = ride()
    assert np.abs(rows[:, 1]).max() < 0.3
    right = brought(rows)
    assert [said for said in sentences(right) if "acceleration" not in said] == []
    rows[:, NAMES.index(name)] *= factor
    if name == "tilt":
        rows[:, 1] = 3.0
    assert any(re.search(doubt, said) for said in sentences(brought(rows)))


def test_wheels_that_brake_are_no_wrong_sign_and_hide_none(brought):
    rows = ride(braking=1.0, wheel_gain=0.92, return_gain=0.02, noise=0.02)
    assert np.abs(rows[:, 1]).max() < 0.3
    said = [doubt for doubt in sentences(brought(rows)) if "sign" in doubt]
    assert said == []
    rows[:, NAMES.index("command")] *= -1
    assert any("the command seems to have the wrong sign" in doubt for doubt in sentences(brought(rows)))


def test_two_torques_without_their_factor_are_said(brought):
    rows = np.column_stack([ROWS[:, :7], ROWS[:, 7], ROWS[:, 7]])
    names = (*NAMES[:-1], "torque_left", "torque_right")
    both = "import.quantities.command={from:[torque_left,torque_right]%s}"
    assert any("their sum is meant" in doubt for doubt in sentences(brought(rows, both % "", names=names)))
    summed = brought(rows, both % ",scale:2", names=names)
    assert not any("their sum is meant" in doubt for doubt in sentences(summed))
    assert only(summed).commands == pytest.approx(2 * ROWS[:-1, 7], abs=1e-7)


@pytest.mark.parametrize("suffix", [".npz", ".npy", ".mat", ".json"])
def test_files_of_arrays_read_like_text(suffix, tmp_path):
    path = tmp_path / f"log{suffix}"
    by_name = {name: ROWS[:, i] for i, name in enumerate(NAMES)}
    if suffix == ".npz":
        np.savez(path, **by_name)
    elif suffix == ".json":
        path.write_text(json.dumps({name: column.tolist() for name, column in by_name.items()} | {"note": "by hand"}))
    elif suffix == ".npy":
        np.save(path, np.rec.fromarrays(list(by_name.values()), names=",".join(NAMES)))
    else:
        scipy.io.savemat(path, {**by_name, "note": "by hand"})
    episode = only(import_file(path, mapping(), Wanted(lambda period: CHANNELS, None, 50), SOURCE))
    assert seen(episode, "tilt") == pytest.approx(ROWS[:, 1])


@pytest.mark.parametrize("suffix", [".npz", ".mat", ".json"])
def test_columns_of_unequal_lengths_are_told_to_be(suffix, tmp_path):
    path = tmp_path / f"log{suffix}"
    by_name = {name: ROWS[: 399 if name == "tilt" else 400, i] for i, name in enumerate(NAMES)}
    if suffix == ".npz":
        np.savez(path, **by_name)
    elif suffix == ".json":
        path.write_text(json.dumps({name: column.tolist() for name, column in by_name.items()}))
    else:
        scipy.io.savemat(path, by_name)
    with pytest.raises(LogError, match=r"unequal lengths: 'tilt' has 399 values, and 'time' has 400\. Expected"):
        import_file(path, mapping(), Wanted(lambda period: CHANNELS, None, 50), SOURCE)
    without = mapping("import.quantities.tilt=null")
    episode = only(import_file(path, without, Wanted(lambda period: CHANNELS, None, 50), SOURCE))
    assert len(episode) == 399


@pytest.mark.parametrize("suffix", formats())
def test_a_file_that_only_has_their_name_is_refused(suffix, tmp_path):
    path = tmp_path / f"log{suffix}"
    path.write_text("no such thing")
    with pytest.raises(LogError, match=re.escape(str(path))):
        import_file(path, mapping(), Wanted(lambda period: CHANNELS, None, 50), SOURCE)


BAD = {
    "no quantity 'tlit'": "{tlit:{from:1}}",
    "tilt cannot be in 'feet'": "{tilt:{from:1,unit:feet}}",
    "has the keys from, unit, scale, offset": "{tilt:{column:1}}",
    "needs a source of `tilt`": "{tilt:null,tilt_rate:null}",
    "both of accelerometer_forward and accelerometer_up": "{accelerometer_up:{from:1}}",
    "what the wheels did": "{wheel_angle:null,wheel_rate:null}",
    "either a `command`": "{command:null}",
    "voltage in % needs a motor": "{command:null,voltage:{from:1,unit:'%'}}",
    "needs the `motor`": "{command:null,voltage:{from:1}}",
    "a source of `time` or a `rate`": "{time:null}",
    "scale that is not 0": "{tilt:{from:1,scale:0}}",
}


@pytest.mark.parametrize("complaint", BAD)
def test_a_mapping_that_cannot_be_is_refused(complaint):
    with pytest.raises(Exception, match=complaint) as caught:
        mapping(f"import.quantities={BAD[complaint]}")
    assert isinstance(caught.value, ConfigError) or isinstance(caught.value.__cause__, ConfigError)


def measured_logs():
    folder = Path(__file__).resolve().parents[4] / "shared" / "measured" / "regbot"
    return sorted(folder.glob("*.txt"))


@pytest.mark.skipif(not measured_logs(), reason="the logs of the real robot are not here")
def test_the_real_robots_logs_are_read_without_hand_edits():
    for path in measured_logs():
        imported = import_file(
            path, mapping("import=regbot", "robot=regbot"), Wanted(lambda period: CHANNELS, None, 50), SOURCE
        )
        episode = only(imported)
        assert episode.control_period == pytest.approx(0.015)
        assert {e.channel for e in episode.estimated} == {"tilt_rate", "wheel_rate", "yaw_rate", "acceleration"}
        lies = any("the robot lies" in doubt for doubt in sentences(imported))
        assert lies == path.name.startswith("test0")
