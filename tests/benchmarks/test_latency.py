"""Whether latencies are measured rightly: on lines and logs that were made up with times that are known."""

import numpy as np
import pytest

from benchmarks.latency.__main__ import CASES, SECONDS, main
from benchmarks.latency.answered import answers, moving
from benchmarks.latency.figures import EDGES_MS, distribution
from benchmarks.latency.line import run as run_line
from benchmarks.latency.losses import after_loss
from benchmarks.latency.steering import main as main_of_steering
from benchmarks.latency.tables import keys, latency, latency_asked, latency_histogram, line_alone, losses
from benchmarks.latency.timed import ARMED, TimedPlant, Times
from benchmarks.latency.withheld import withheld_share
from twbal.core.episode import Episode, Event, Outcome, Provenance
from twbal.core.errors import LinkLostError
from twbal.core.plant import Observation, Plant
from twbal.link.protocol import Clock
from twbal.link.transport import Transport
from twbal.virtual_robot.firmware import Firmware, Identity

PERIOD_US = 20_000
IDENTITY = Identity("still", torque_limit=20.0, tilt_limit=1.0, watchdog=0.1, clock=Clock.REAL_TIME)


class Still(Plant):
    """Stands."""

    control_period, turns = 1e-6 * PERIOD_US, False

    def __init__(self):
        self.steps = 0

    def reset(self, trial):
        return Observation(*(0.0,) * 7)

    def step(self, command):
        self.steps += 1
        return Observation(self.steps * self.control_period, *(0.0,) * 6)

    def stop(self):
        pass

    def close(self):
        pass


class SlowLine(Transport):
    """To a robot in this process: each message takes its own time [µs] to it, and its answers none."""

    name = "memory"

    def __init__(self, delays, now_us):
        self.firmware, self._delays, self.now_us = Firmware(Still(), IDENTITY), iter(delays), now_us
        self._waiting = b""

    def write(self, data):
        self.now_us += next(self._delays, 0)
        self._waiting += self.firmware.advance(self.now_us) + self.firmware.receive(data, self.now_us)

    def read(self):
        if not self._waiting and self.firmware.next_tick_us is not None:
            self.now_us = self.firmware.next_tick_us
            self._waiting += self.firmware.advance(self.now_us)
        data, self._waiting = self._waiting, b""
        return data

    def close(self):
        pass


def timed(delays, file, now_us=1_000_000):
    plant = TimedPlant(SlowLine([0, 0, *delays], now_us), 1.0, 1.0, 1.0)  # the first two are Hello and Arm
    plant.file = file
    return plant


@pytest.mark.parametrize("now_us", [1_000_000, 2**32 - 50_000], ids=["", "the clock overflows"])
def test_the_time_of_a_command_is_what_the_line_took(tmp_path, now_us):
    delays = [300, 4_900, 0, 12_000, 31_000, 800]  # the fifth is later than a control period, and is sent again
    file = tmp_path / "times.npz"
    with timed([*delays[:5], 0, *delays[5:]], file, now_us) as plant:
        plant.reset(0)
        assert (tmp_path / f"times.npz{ARMED}").exists()
        for _ in delays:
            plant.step(0.0)
    assert np.multiply(Times.read(file).seconds, 1e6).tolist() == pytest.approx(delays)


def test_a_command_that_the_watchdog_did_not_wait_for_took_at_least_as_long_as_it(tmp_path):
    file = tmp_path / "times.npz"
    with timed([500, 140_000], file) as plant:
        plant.reset(0)
        plant.step(0.0)
        with pytest.raises(LinkLostError, match="watchdog"):
            plant.step(0.0)
    answered, late = Times.read(file).seconds
    assert answered == pytest.approx(5e-4) and late >= 0.1


def test_shares_percentiles_and_histogram_of_times_that_are_known():
    made = [*[1e-3] * 900, *[3e-3] * 90, *[7e-3] * 9, 0.15]
    found = distribution(np.random.default_rng(0).permutation(made), 0.01)
    assert found["within_2_ms"] == pytest.approx(90.0) and found["within_5_ms"] == pytest.approx(99.0)
    assert found["percentiles_ms"] == {"50": 1.0, "90": 1.0, "99": 3.0, "99.9": 7.0}
    assert (found["longest_ms"], found["late"], found["commands"]) == (150.0, 1, 1000)
    counted = dict(zip(EDGES_MS, found["histogram"], strict=True))
    assert {edge: count for edge, count in counted.items() if count} == {1.0: 900, 2.0: 90, 5.0: 9, 100.0: 1}


def test_what_a_virtual_machine_does_not_have_is_the_share_of_all_times(tmp_path):
    stat = tmp_path / "stat"
    stat.write_text("cpu 100 0 50 800 0 0 0 10 7 0\ncpu0 100 0 50 800 0 0 0 10 7 0\n")
    since = withheld_share(stat)
    assert since() is None  # no time has passed
    stat.write_text("cpu 120 0 60 860 0 0 0 20 9 0\n")  # a guest's time is part of the user's
    assert since() == 10.0
    assert withheld_share(tmp_path / "none")() is None


def drive(presses, begun, seconds=4.0, answer_us=1_500):
    """Times of a drive that begins at a time [s]; its reference moves for 0.3 s from the observation after a press."""
    measured = np.arange(int(begun * 1e6), int((begun + seconds) * 1e6), PERIOD_US)
    read = [measured[np.searchsorted(measured, press * 1e6)] for press in presses]  # the first observation after it
    moves = np.any([(measured > at) & (measured < at + 300_000) for at in read], axis=0)
    return measured % 2**32, (measured + answer_us) % 2**32, moves


@pytest.mark.parametrize("begun", [100.0, 2**32 * 1e-6 - 1.5], ids=["", "the clock overflows"])
def test_a_press_is_answered_by_the_first_command_of_a_moving_reference(begun):
    waits = (0.001, 0.0105, 0.019)  # until the next observation
    presses = [begun + 0.02 * round(50 * at) - wait for at, wait in zip((1.0, 2.0, 3.0), waits, strict=True)]
    found = answers(presses, *drive(presses, begun))
    assert found == pytest.approx([wait + 0.02 + 0.0015 for wait in waits], abs=3e-6)


def test_a_press_that_nothing_follows_and_one_amid_another_are_told_apart():
    presses = [101.0, 101.1, 103.5]
    measured, taken, moves = drive([101.0], 100.0)
    found = answers(presses, measured, taken, moves)
    assert np.isfinite(found[0]) and np.isnan(found[1]) and found[2] == np.inf


def episode(references, events, outcome):
    count = len(references)
    observations = np.column_stack([0.02 * np.arange(count), np.zeros((count, 6))])
    return Episode(
        channels=("tilt",),
        control_period=0.02,
        observations=observations,
        states=np.zeros((count, 1)),
        commands=np.zeros(count - 1),
        outcome=outcome,
        provenance=Provenance("still", "robot"),
        events=events,
        references=references,
    )


def test_what_follows_a_loss_is_told_since_the_loss():
    references = np.zeros((201, 3))
    references[50:150, 1] = 0.25  # until 3 s
    events = (Event(0.4, "the reference gives way"), Event(2.02, "it was lost: the reference goes to rest"))
    drive = episode(references, events, Outcome.COMPLETED)
    assert moving(references).sum() == 100
    measured = 50_000_000 + PERIOD_US * np.arange(200)
    found = after_loss(drive, Times(measured, measured + 1000, stopped=54.5), lost=52.0)
    assert found["speed"] == 0.25 and found["events"] == ["it was lost: the reference goes to rest"]
    assert (found["noticed"], found["at_rest"], found["motors_off"]) == pytest.approx((0.021, 1.0, 2.5))
    assert found["outcome"] == "completed"
    stopped = episode(references[:102], (Event(2.02, "stopped by a key"),), Outcome.STOPPED)
    read_late = Times(measured[:101], measured[:101], stopped=52.025)  # with the observation before the loss
    found = after_loss(stopped, read_late, lost=52.0205)
    assert (found["noticed"], found["at_rest"], found["motors_off"]) == pytest.approx((0.005, None, 0.005), abs=6e-4)


def case(host, load, rate, latencies, falls=0, seconds=600.0):
    found = {"seconds": seconds, "falls": falls, "first_fall": 3.2 if falls else None}
    asked = {"host": host, "load": load, "rate": rate, "seconds": seconds}
    return {"settings": asked, "result": {**found, **distribution(latencies, 1.0 / rate)}}


def results(*cases):
    return {"machine": "a machine", "date": "a day", "cases": list(cases)}


def test_tables_say_what_was_measured_and_what_was_missed():
    good, bad = [1e-3] * 1000, [*[1e-3] * 980, *[6e-3] * 20]
    board = case("on_board", 8, 100, bad)
    measured = results(case("real_time", 8, 100, bad, falls=2), case("real_time", 0, 100, good), board)
    lines = latency(measured)
    assert lines[2].startswith("| on the host, real-time priority | 100 | none | 100.00 % | 100.00 % | 1.0 ms")
    assert lines[3].endswith("| 0 of 1000 | 2 in 600 s, the first after 3.2 s | - |") and "| 98.00 % |" in lines[3]
    asked = "\n".join(latency_asked(measured))
    assert "98.00 %: **missed**" in asked and "100.00 %: met" in asked
    assert "no fall | 2 falls in 600 s: **missed**" in asked and "no fall | 0 falls in 600 s: met" in asked
    assert [line.count("|") for line in latency_histogram(measured)] == [len(EDGES_MS) + 2] * 4
    short = replace_seconds(case("real_time", 8, 100, good), 5.0)
    assert latency(results(*measured["cases"], short)) == lines  # the longer one counts


def replace_seconds(case, seconds):
    return {**case, "settings": {**case["settings"], "seconds": seconds}}


def test_tables_of_steering_and_of_the_line_have_a_line_a_case():
    pressed = {"presses": 3, "unanswered": 0, **distribution([0.025, 0.03, 0.041], 0.04)}
    by_key = {"settings": {"by": "keyboard", "presses": 3}, "result": pressed}
    assert keys(results(by_key))[2] == "| keys w and s | 3 | 30.0 ms | 41.0 ms | 41.0 ms | 0 |"
    said = {
        "speed": 0.3,
        "noticed": 0.015,
        "at_rest": None,
        "motors_off": 0.016,
        "events": ["stopped by a key"],
        "ends": True,
    }
    stop = {"settings": {"loss": "stop key"}, "result": {**said, "outcome": "stopped", "exit_code": 0}}
    shown = losses(results(stop, by_key))
    assert shown[2] == "| stop key | 0.30 m/s | stopped by a key | 15 ms | - | 16 ms | stopped, 0 |" and len(shown) == 5
    line = {"settings": {"line": "pty", "load": 8}, "result": distribution([1e-3], 0.01)}
    assert line_alone(results(line))[2].startswith("| a pseudo-terminal alone, there and back | 8 | 100.00 %")


@pytest.mark.skipif(not hasattr(__import__("os"), "sched_setscheduler"), reason="Linux's own")
def test_a_line_alone_is_measured(monkeypatch):
    monkeypatch.setattr("os.sched_setscheduler", lambda *asked: None)
    found = run_line(load=0, line="socket", seconds=0.1)
    assert found["commands"] == 10 and 0.0 < found["longest_ms"] < 1e3


def test_all_cases_have_names_and_take_less_than_half_an_hour():
    assert len(CASES) == 2 * 3 * 3 + 2 * 3
    assert sum(SECONDS.values()) < 1800.0
    assert SECONDS["load_real_time_100"] == SECONDS["load_on_board_100"] == 600.0


@pytest.mark.parametrize(
    ("run", "word", "message"),
    [
        (main, "secnods=3", "unknown settings: secnods"),
        (main, "seconds=-1", "seconds .a positive number"),
        (main, "cases=busy", "cases .of quiet_real_time_50"),
        (main_of_steering, "presses=0", "presses .a number from 1 on"),
        (main_of_steering, "cases=feet", "cases .of keyboard, gamepad"),
    ],
)
def test_settings_that_cannot_be_right_are_refused(run, word, message):
    with pytest.raises(SystemExit, match=message):
        run([word])
