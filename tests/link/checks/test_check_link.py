"""Each thing that can be wrong with a robot is found by its own check, and a good robot passes them all."""

from dataclasses import replace

import pytest
from held_robot import (
    PERIOD,
    DeafToStop,
    HeldRobot,
    SilentWatchdog,
    TripsAtStop,
    TripsBeforeItsWatchdog,
    TripsByTorque,
    TripsWithoutReason,
    WakesForGood,
    WakesUp,
    damaging,
    lossy,
)
from pendulum import MemoryTransport, Pendulum

from twbal.core.check import CheckStatus
from twbal.core.errors import LinkLostError
from twbal.link.checks.line import clock_check
from twbal.link.checks.procedure import LinkTrial, check_link
from twbal.link.checks.telemetry_record import record
from twbal.link.protocol import Clock, Status
from twbal.link.serial_plant import SerialPlant
from twbal.link.wheel_commands import WheelCommands
from twbal.virtual_robot.firmware import Firmware, Identity

TRIAL = LinkTrial(exchanges=60, rest=1.0, pulse=0.1, pulse_time=0.3, is_held=True, by_hand=False, hand_time=1.0)
US_PER_READ = 1000


class Bench:
    """A robot on a line in memory, whose clock the host's is a multiple of."""

    def __init__(self, plant, firmware=Firmware, clock=Clock.LOCKSTEP, version=2, fast=1.0, watchdog=0.1):
        me = Identity("held", torque_limit=4.0, tilt_limit=1.0, watchdog=watchdog, clock=clock, version=version)
        self.line = MemoryTransport(firmware(plant, me), US_PER_READ if clock is Clock.REAL_TIME else 0)
        self.plant = SerialPlant(self.line, 1.0, 1.0, 0.6)
        self._fast = fast

    def time(self):
        return self.line.now_us * 1e-6 / self._fast

    def verdicts(self, trial=TRIAL, sheet=None):
        self.report = check_link(self.plant, trial, lambda _: None, clock=self.time, sheet=sheet)
        self.found = {check.name: check for check in self.report.checks}
        return {name: check.verdict.value for name, check in self.found.items()}

    def problems(self, trial=TRIAL):
        return {name for name, verdict in self.verdicts(trial).items() if verdict == "problem"}


GOOD = {
    **{"handshake": "ok", "round trip": "ok", "losses": "ok", "clock": "ok", "sensors at rest": "ok", "stop": "ok"},
    **{"watchdog": "ok", "torque sign": "ok", "dead time": "ok", "difference sign": "ok", "signs by hand": "skipped"},
}


def test_a_good_robot_passes_and_signs_by_hand_are_not_called_ok():
    bench = Bench(HeldRobot(), clock=Clock.REAL_TIME)
    assert bench.verdicts() == GOOD
    assert "does not measure: heading, battery" in bench.found["handshake"].found
    assert len(bench.report.round_trips) == TRIAL.exchanges


def test_a_robot_of_version_1_passes_what_it_can_tell():
    verdicts = Bench(HeldRobot(), version=1, clock=Clock.REAL_TIME).verdicts()
    assert verdicts == {**GOOD, "difference sign": "skipped"}


def test_a_robot_in_lockstep_has_no_watchdog_and_no_clock_of_its_own():
    assert Bench(HeldRobot(), clock=Clock.LOCKSTEP).verdicts() == {**GOOD, "clock": "skipped", "watchdog": "skipped"}


def test_swapped_torque_signs_are_found():
    bench = Bench(HeldRobot(signs=(-1.0, -1.0)))
    assert bench.problems() == {"torque sign"}
    assert "backward" in bench.found["torque sign"].found
    assert bench.found["difference sign"].verdict is CheckStatus.SKIPPED


@pytest.mark.parametrize(
    ("signs", "wheel", "advice"),
    [
        ((-1.0, 1.0), "the left wheel by -", "Swap the leads of the motor of the left wheel"),
        ((1.0, -1.0), "the right wheel by -", "Swap the leads of the motor of the right wheel"),
        ((1.0, 0.0), "the right wheel by +0", "Of the right wheel, which does not turn, check motor"),
    ],
)
def test_one_wheel_that_does_not_follow_is_found_and_nothing_else_is_said_of_it(signs, wheel, advice):
    bench = Bench(HeldRobot(signs=signs))
    assert bench.problems() == {"torque sign"}
    assert wheel in bench.found["torque sign"].found
    assert bench.found["torque sign"].advice.startswith(advice)
    assert {bench.found[name].verdict for name in ("dead time", "difference sign")} == {CheckStatus.SKIPPED}


def test_swapped_wheels_are_found_by_the_difference_alone():
    assert Bench(HeldRobot(swapped=True)).problems() == {"difference sign"}


def test_motors_that_do_not_move_are_a_problem_and_a_larger_pulse_moves_them():
    stuck = HeldRobot(dead_zone=0.3)  # a wheel gets half of 0.1 · 4 N·m
    assert Bench(stuck).problems() == {"torque sign"}
    assert not Bench(stuck).problems(replace(TRIAL, pulse=0.3))


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_dead_time_is_that_of_the_robot(delay):
    bench = Bench(HeldRobot(delay=delay))
    bench.verdicts()
    milliseconds = int(bench.found["dead time"].found.split()[0])
    assert abs(milliseconds * 1e-3 - delay * PERIOD) <= 0.6 * PERIOD


class Sticking(HeldRobot):
    """Its wheels give way by 0.012 rad and stick there, as in tyres or gears."""

    def step(self, command):
        seen = super().step(command)
        return seen._replace(wheel_angle=min(seen.wheel_angle, 0.012), wheel_rate=0.0)


def test_wheels_that_move_and_stick_tell_no_dead_time():
    bench = Bench(Sticking(delay=2))
    bench.verdicts()
    found = bench.found["dead time"]
    assert found.verdict is CheckStatus.SKIPPED and "larger pulse" in found.advice and not found.measured


def test_a_watchdog_that_does_not_bite_is_found_and_the_motors_are_not_driven_after_it():
    bench = Bench(HeldRobot(), SilentWatchdog, clock=Clock.REAL_TIME)
    assert bench.problems() == {"watchdog"}
    assert "the motors were still on" in bench.found["watchdog"].found
    assert bench.found["motors"].verdict is CheckStatus.SKIPPED


def test_a_watchdog_that_bites_late_is_found():
    bench = Bench(HeldRobot(), watchdog=0.2, clock=Clock.REAL_TIME)
    assert bench.problems() == {"watchdog"}
    milliseconds = int(bench.found["watchdog"].found.split()[2])
    assert 200 < milliseconds <= 220


@pytest.mark.parametrize(
    ("firmware", "by", "advice"),
    [
        (TripsBeforeItsWatchdog, "its tilt limit", "Hold it upright and still"),
        (TripsWithoutReason, "what it does not say", "Let its firmware say by WATCHDOG_STOPPED"),
    ],
)
def test_a_robot_that_something_else_stops_has_no_watchdog_that_was_seen(firmware, by, advice):
    bench = Bench(HeldRobot(), firmware, clock=Clock.REAL_TIME)
    assert bench.problems() == {"watchdog"}
    assert bench.found["watchdog"].found == f"not its watchdog switched it off, but {by}"
    assert bench.found["watchdog"].advice.startswith(advice)
    assert bench.found["motors"].verdict is CheckStatus.SKIPPED


@pytest.mark.parametrize(
    ("firmware", "found"),
    [
        (TripsByTorque, "it was off before Stop came, by its tilt limit"),
        (TripsAtStop, "not Stop switched it off, but a sensor that failed"),
    ],
)
def test_a_robot_that_was_off_before_stop_is_not_taken_for_one_that_obeys_it(firmware, found):
    bench = Bench(HeldRobot(), firmware)
    assert bench.problems() == {"stop"}
    assert bench.found["stop"].found == found
    assert bench.found["motors"].verdict is CheckStatus.SKIPPED


def test_a_robot_that_does_not_obey_stop_is_found_and_the_motors_are_not_driven_after_it():
    bench = Bench(HeldRobot(), DeafToStop, clock=Clock.REAL_TIME)
    assert bench.problems() == {"stop"}
    assert bench.found["stop"].found == "it answers Stop, and its motors stay on"
    assert bench.found["motors"].verdict is CheckStatus.SKIPPED


def test_a_robot_that_never_switches_off_is_said_to_be_still_on():
    bench = Bench(HeldRobot(), DeafToStop)
    bench.verdicts()
    said = " ".join(check.found for check in bench.report.checks if check.verdict is CheckStatus.PROBLEM)
    assert "MAY STILL BE ON" in said
    assert bench.report.motors_may_be_on


def test_a_robot_that_a_command_wakes_after_stop_is_found():
    bench = Bench(HeldRobot(), WakesUp)
    assert "stop" in bench.problems()
    assert "switched it on again" in bench.found["stop"].found
    assert not bench.line.firmware._status & Status.ARMED  # it is stopped once more
    assert not bench.report.motors_may_be_on


def test_a_robot_that_a_command_wakes_for_good_is_said_to_be_still_on():
    bench = Bench(HeldRobot(), WakesForGood)
    assert bench.problems() == {"stop"}
    assert "THEY MAY STILL BE ON" in bench.found["stop"].found
    assert bench.report.motors_may_be_on


def test_a_robot_that_falls_silent_as_it_is_armed_is_said_to_be_still_on():
    bench = Bench(HeldRobot())
    bench.plant._arm_timeout = 0.2
    bench.line.to_host = lambda data: b"" if bench.line.firmware._status & Status.ARMED else data
    bench.line.to_robot = lambda data: b"" if bench.line.firmware._status & Status.ARMED else data
    assert bench.problems() == {"rest", "motors off"}
    assert bench.found["rest"].found.startswith("No answer to Arm")
    assert "is the baud rate right? Is this computer busy" in bench.found["rest"].line(8)
    assert "THEY MAY STILL BE ON" in bench.found["motors off"].found
    assert bench.report.motors_may_be_on
    bench.plant.close()


@pytest.mark.parametrize("fault", [lossy(0.05), damaging(0.05)])
@pytest.mark.parametrize("way", ["to_robot", "to_host"])
def test_a_bad_line_is_found(fault, way):
    bench = Bench(HeldRobot())
    setattr(bench.line, way, fault)
    assert bench.verdicts()["losses"] == "problem"


@pytest.mark.parametrize(("fast", "percent", "sense"), [(1.05, 5.0, "fast"), (0.9, 10.0, "slow")])
def test_a_clock_that_runs_at_another_rate_is_found(fast, percent, sense):
    bench = Bench(HeldRobot(), fast=fast, clock=Clock.REAL_TIME)
    assert bench.problems() == {"clock"}
    found = bench.found["clock"].found.split()
    assert float(found[3].rstrip("%")) == pytest.approx(percent, abs=0.2)
    assert found[4].rstrip(",") == sense


@pytest.mark.parametrize(("bias", "noise"), [(0.2, 0.003), (-0.2, 0.003), (0.0, 0.5)])
def test_a_gyro_with_bias_or_much_noise_is_found(bias, noise):
    bench = Bench(HeldRobot(bias=bias, noise=noise))
    assert bench.problems() == {"sensors at rest"}


def test_bias_and_noise_are_those_of_the_robot():
    bench = Bench(HeldRobot(bias=0.0123, noise=0.004))
    bench.verdicts(replace(TRIAL, exchanges=10, rest=20.0))
    words = bench.found["sensors at rest"].found.split()
    assert float(words[2]) == pytest.approx(0.0123, abs=4 * 0.004 / 1000**0.5)
    assert float(words[5]) == pytest.approx(0.004, rel=0.1)


@pytest.mark.parametrize(("is_held", "verdict"), [(True, "problem"), (False, "skipped")])
def test_a_robot_that_falls_was_not_at_rest_and_only_one_that_nobody_holds_may(is_held, verdict):
    bench = Bench(Pendulum())
    assert bench.verdicts(replace(TRIAL, exchanges=20, rest=0.4, is_held=is_held))["sensors at rest"] == verdict


def test_a_line_that_breaks_is_a_problem_and_what_follows_is_skipped():
    bench = Bench(HeldRobot())
    begun = []

    def breaks(data):
        begun.append(data)
        if len(begun) > 80:
            raise LinkLostError("The port memory is gone.")
        return data

    bench.line.to_robot = breaks
    verdicts = bench.verdicts()
    assert verdicts["rest"] == "problem"
    assert [verdicts[part] for part in ("stop", "watchdog", "by hand", "motors")] == ["skipped"] * 4


@pytest.mark.parametrize("limit", [4.0 * 3.01, 4.0 / 3.01])
def test_a_sheet_of_another_robot_is_a_problem_before_anything_is_tried(limit, paper):
    robot = HeldRobot()
    bench, said = Bench(robot), []
    robot.reset = lambda trial: pytest.fail("armed")
    report = check_link(bench.plant, TRIAL, said.append, clock=bench.time, sheet=replace(paper, torque_limit=limit))
    assert [check.name for check in report.checks][:3] == ["handshake", "sheet", "line"]
    assert report.checks[1].verdict is CheckStatus.PROBLEM
    assert {check.verdict for check in report.checks[2:]} == {CheckStatus.SKIPPED}
    assert ("another unit than N·m" in report.checks[1].advice) is (limit < 4.0)
    assert not said


@pytest.mark.parametrize(("limit", "least"), [(11.9, 4.0), (2.0, 2.0), (4.0 / 2.99, 4.0 / 2.99)])
def test_a_pulse_is_a_share_of_the_lower_limit_of_robot_and_sheet(limit, least, paper):
    robot, given = HeldRobot(), []
    step = robot.step
    robot.step = lambda command: given.append(command) or step(command)
    verdicts = Bench(robot).verdicts(replace(TRIAL, pulse=0.2), replace(paper, torque_limit=limit))
    assert verdicts == {**GOOD, "sheet": "ok", "clock": "skipped", "watchdog": "skipped"}
    assert max(given) == pytest.approx(0.2 * least)


def test_many_missed_periods_are_a_warning_of_the_clock():
    bench = Bench(HeldRobot(), clock=Clock.REAL_TIME)
    bench.plant.reset(0)
    rest = record(bench.plant, [WheelCommands(0.0)] * 100, bench.time)
    assert clock_check(bench.plant, rest._replace(missed=1)).verdict is CheckStatus.OK
    late = clock_check(bench.plant, rest._replace(missed=8))
    assert late.verdict is CheckStatus.WARNING
    assert "8 of 100 periods missed" in late.found
    assert len(late.measured) == 2


def test_ctrl_c_in_a_pulse_leaves_the_motors_off():
    bench = Bench(HeldRobot())

    def pressed(part):
        if part.startswith("motors"):
            bench.line.to_robot = interrupt

    def interrupt(data):
        bench.line.to_robot = lambda data: data
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        check_link(bench.plant, TRIAL, pressed, clock=bench.time)
    bench.plant.close()
    assert bench.line.firmware._standing


def test_checks_hand_on_the_numbers_that_they_found():
    bench = Bench(HeldRobot(bias=0.02, noise=0.004, delay=2), clock=Clock.REAL_TIME)
    bench.verdicts()
    measured = {each.name: each.value for check in bench.report.checks for each in check.measured}
    assert measured["control period by the robot's clock"] == pytest.approx(PERIOD, rel=1e-3)
    assert measured["gyro bias"] == pytest.approx(0.02, abs=3 * 0.004 / 50**0.5)
    assert measured["gyro noise"] == pytest.approx(0.004, rel=3 / (2 * 50) ** 0.5)
    assert measured["dead time"] == pytest.approx(2 * PERIOD, abs=PERIOD)
    assert abs(measured["drift of the robot's clock"]) < 0.02
