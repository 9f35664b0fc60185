"""Columns that slower sensors fill in some rows alone: the commands of the other rows act all the same."""

import numpy as np
import pytest
from foreign_logs import NAMES, PERIOD, columns, text

from twbal.core.channels import Channels
from twbal.core.episode import Provenance
from twbal.core.motor import Motor
from twbal.io.importers.checks.doubt import DoubtKind
from twbal.io.importers.conversion import Wanted, import_file
from twbal.io.importers.mapping import mapping

ROWS = columns()
ROWS[:, -1] = np.random.default_rng(7).standard_normal(len(ROWS))  # commands that no interpolation knows
COMMANDS = ROWS[:, -1]
CHANNELS = Channels(("tilt", "tilt_rate", "speed", "command_1"), 0.1)
WANTED = Wanted(lambda period: CHANNELS, None, 50)
UNITS = dict(zip(NAMES, ("s", "rad", "rad/s", "m/s²", "rad/s", "rad", "rad/s", "N·m"), strict=True))
WHEELS = [NAMES.index("wheel_angle"), NAMES.index("wheel_rate")]


def with_empty(empty, places=WHEELS, rows=ROWS):
    """The rows, in which the fields at `places` are missing where `empty` says so."""
    found = rows.copy()
    for place in places:
        found[empty, place] = np.nan
    return found


@pytest.fixture
def brought(tmp_path):
    def bring(rows, names=NAMES, motor=None, sources=None, **how):
        path = tmp_path / "log.csv"
        path.write_text(text(rows, names=names))
        told = {name: {"from": name, "unit": UNITS[name]} for name in names if name in UNITS} | (sources or {})
        entries = {"rate": None, "command_is_sample": False, "command_before_sample": False, "skip": 0.0, "fill": 3}
        chosen = mapping(told, [], **(entries | how), motor=motor)
        return import_file(path, chosen, WANTED, Provenance("mine", "robot"))

    return bring


def only(imported):
    (episode,) = imported.episodes
    return episode


EVERY = 4
SLOW = np.arange(len(ROWS)) % EVERY != 0


def test_the_command_of_a_kept_row_is_the_mean_of_those_until_the_next(brought):
    episode = only(brought(with_empty(SLOW)))
    assert episode.control_period == pytest.approx(EVERY * PERIOD)
    assert episode.tilt == pytest.approx(ROWS[::EVERY, 1], abs=1e-8)
    assert episode.commands == pytest.approx(COMMANDS.reshape(-1, EVERY).mean(axis=1)[:-1], abs=1e-8)


def test_commands_that_act_before_their_rows_are_those_since_the_row_before(brought):
    episode = only(brought(with_empty(SLOW), command_before_sample=True))
    assert episode.commands == pytest.approx(COMMANDS[1:-3].reshape(-1, EVERY).mean(axis=1), abs=1e-8)


def test_samples_of_a_faster_loop_run_straight_through_the_rows_left_out(brought):
    episode = only(brought(with_empty(SLOW), command_is_sample=True))
    straight = 0.5 * (COMMANDS[1:] + COMMANDS[:-1])
    assert episode.commands == pytest.approx(straight[:-3].reshape(-1, EVERY).mean(axis=1), abs=1e-8)


def test_a_rate_in_place_of_time_leads_to_the_same(brought):
    rows = with_empty(SLOW)[:, 1:]
    episode = only(brought(rows, names=NAMES[1:], rate=1.0 / PERIOD))
    assert episode.control_period == pytest.approx(EVERY * PERIOD)
    assert episode.commands == pytest.approx(COMMANDS.reshape(-1, EVERY).mean(axis=1)[:-1], abs=1e-8)


def test_the_mean_voltage_is_that_of_voltages_within_the_supply(brought):
    motor = Motor(resistance=1.0, torque_constant=0.1, gear=10.0, supply=6.0)
    rows = with_empty(SLOW)
    rows[:, -1] *= 10.0
    sources = {"voltage": {"from": "drive", "unit": "V"}}
    episode = only(brought(rows, names=(*NAMES[:-1], "drive"), motor=motor, sources=sources))
    volts = np.clip(10.0 * COMMANDS, -6.0, 6.0)
    assert episode.commands == pytest.approx(
        motor.torque_per_volt * volts.reshape(-1, EVERY).mean(axis=1)[:-1], abs=1e-6
    )


def test_a_row_in_whose_period_another_is_torn_has_the_mean_of_the_rest(brought):
    rows = with_empty(SLOW)
    rows[41, -1] = np.nan
    expected = COMMANDS.reshape(-1, EVERY).mean(axis=1)[:-1]
    expected[10] = COMMANDS[[40, 42, 43]].mean()
    assert only(brought(rows)).commands == pytest.approx(expected, abs=1e-8)


def test_a_period_that_is_missing_takes_nothing_from_the_rows_before_it(brought):
    """Row 44 has no encoder, either: that sample is missing, and the one before it acts for its own period."""
    rows = with_empty(SLOW)
    rows[44, WHEELS] = np.nan
    episode = only(brought(rows))
    expected = np.delete(COMMANDS.reshape(-1, EVERY).mean(axis=1)[:-1], 11)
    assert episode.commands == pytest.approx(expected, abs=1e-8)


def test_a_few_rows_without_a_sensor_leave_commands_as_they_are(brought):
    """A sample that is missing now and then is no slower sensor: its neighbours act for one row each."""
    empty = np.isin(np.arange(len(ROWS)), [100, 250])
    imported = brought(with_empty(empty))
    assert only(imported).commands == pytest.approx(np.delete(COMMANDS[:-1], [100, 250]), abs=1e-8)
    assert not any("is empty in" in doubt.sentence for doubt in imported.doubts)


def warned(imported):
    return [doubt for doubt in imported.doubts if "empty in" in doubt.sentence]


def test_a_slow_column_that_is_needed_is_warned_of_with_its_share(brought):
    (doubt,) = warned(
        brought(with_empty(SLOW, WHEELS[:1])[:, [0, 1, 5, 7]], names=("time", "tilt", "wheel_angle", "command"))
    )
    assert doubt.kind is DoubtKind.ROW and doubt.quantity == "wheel_angle"
    assert "wheel_angle (column 'wheel_angle') is empty in 75% of the rows" in doubt.sentence
    assert "4 rows" in doubt.sentence and "Log it in each row" in doubt.sentence
    assert "=null" not in doubt.sentence


def test_a_slow_column_that_one_can_do_without_is_warned_of_with_how(brought):
    (doubt,) = warned(brought(with_empty(SLOW, [NAMES.index("yaw_rate")])))
    assert "++import.quantities.yaw_rate=null" in doubt.sentence


def test_rows_that_are_empty_more_often_than_one_in_twenty_are_warned_of(brought):
    count = len(ROWS) // 20
    places = np.linspace(5, len(ROWS) - 5, count + 1).astype(int)
    assert warned(brought(with_empty(np.isin(np.arange(len(ROWS)), places))))
    assert not warned(brought(with_empty(np.isin(np.arange(len(ROWS)), places[:-1]))))


def test_the_commands_of_slow_rows_answer_no_measurement_that_comes_later(brought):
    """A regulator that answers each row also answers the rows that are left out: no reason to shift its commands."""
    rng = np.random.default_rng(3)
    rows = columns(4000)
    rows[:, 1] += 0.02 * np.cumsum(rng.standard_normal(len(rows))) * 0.2
    rows[:, 2] = np.gradient(rows[:, 1], PERIOD) + 0.01 * rng.standard_normal(len(rows))
    rows[:, 7] = 3.0 * rows[:, 1] + 0.5 * rows[:, 2]
    found = brought(with_empty(np.arange(len(rows)) % EVERY != 0, rows=rows))
    assert not any("commands stand a row" in doubt.sentence for doubt in found.doubts)


def test_a_command_that_is_slow_itself_is_warned_of_and_stays_as_it_is(brought):
    imported = brought(with_empty(SLOW, [NAMES.index("command")]))
    (doubt,) = warned(imported)
    assert doubt.quantity == "command" and "fill its empty fields with the value before" in doubt.sentence
    assert only(imported).commands == pytest.approx(COMMANDS[::EVERY], abs=1e-8)  # the last row has a sample, too


def test_two_commands_with_scales_of_their_own_are_clipped_each_by_its_own(brought):
    motor = Motor(resistance=1.0, torque_constant=0.1, gear=10.0, supply=6.0)
    rows = np.column_stack([with_empty(SLOW)[:, :-1], 10.0 * COMMANDS, -100.0 * COMMANDS])
    sources = {"voltage": {"from": ["l", "r"], "unit": "V", "scale": [1.0, -0.1]}}
    episode = only(brought(rows, names=(*NAMES[:-1], "l", "r"), motor=motor, sources=sources))
    volts = np.clip(10.0 * COMMANDS, -6.0, 6.0).reshape(-1, EVERY).mean(axis=1)[:-1]
    assert episode.commands == pytest.approx(motor.torque_per_volt * volts, abs=1e-6)
