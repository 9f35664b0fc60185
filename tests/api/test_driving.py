"""Rollouts and trials by the library are those of the commands, and of the robot that is asked for."""

import os
import signal
import threading
from dataclasses import replace

import numpy as np
import pytest
from held_robot import HeldRobot
from served import served

import twbal
from twbal.cli.main import main
from twbal.core.errors import ConfigError, LinkError, LinkLostError
from twbal.core.plant import Observation, Plant
from twbal.effects.dead_zone import DeadZone
from twbal.effects.torque_gain import TorqueGain
from twbal.link.protocol import Clock
from twbal.policies.policy import Policy
from twbal.virtual_robot.firmware import Firmware, Identity

POLICY = "data/regression/policy.pt"


@pytest.fixture
def policy(request):
    return twbal.load_policy(request.config.rootpath / POLICY)


def test_a_simulated_rollout_is_that_of_the_command(tmp_path, as_from_a_shell):
    assert main(["sim-collect", "rollouts=2", "steps=12", "seed=4", f"hydra.run.dir={tmp_path / 'sim'}"]) == 0
    logged = twbal.read_episodes(tmp_path / "sim")
    for ours, theirs in zip(twbal.simulate(trials=2, steps=12, seed=4), logged, strict=True):
        np.testing.assert_array_equal(ours.observations, theirs.observations)
        np.testing.assert_array_equal(ours.commands, theirs.commands)


def test_parameters_of_ones_own_are_simulated(policy):
    heavy = replace(twbal.robot(), name="heavy", body_mass=20.0)
    (own,), (nominal,) = (twbal.simulate(robot, policy, steps=8) for robot in (heavy, "paper"))
    assert own.provenance.robot == "heavy"
    assert twbal.setup(heavy).simulation.robot.tolerance_factors == heavy.tolerance_factors
    assert np.abs(own.tilt - nominal.tilt)[1:].min() > 0


def test_an_effect_changes_the_rollout_and_one_that_does_nothing_does_not(policy):
    nominal, weak, same = (
        twbal.simulate(policy=policy, effects=effects, steps=10)[0].tilt
        for effects in ([], [TorqueGain(0.5)], [DeadZone(0.0)])
    )
    np.testing.assert_array_equal(nominal, same)
    assert np.abs(nominal - weak).max() > 1e-3


def test_trials_on_a_plant_are_those_in_its_simulation(policy):
    effects, quick = [TorqueGain(0.9)], ["success.duration=1.2", "success.settle_time=0.6", "success.place_time=0"]
    quick.append("search.horizon=60")
    simulated = twbal.evaluate(policy, effects=effects, trials=2, overrides=quick)
    with twbal.setup().simulation.having(effects).plant(seed=0) as plant:
        driven = twbal.evaluate(policy, plant=plant, trials=2, overrides=quick)
    assert (driven.successes, driven.cost, driven.drift) == (simulated.successes, simulated.cost, simulated.drift)


def test_a_setting_that_there_is_not_is_one_clear_error(policy):
    with pytest.raises(ConfigError, match=r"no setting 'success\.lasts'"):
        twbal.evaluate(policy, overrides=["success.lasts=3"])


class Unread(Plant):
    """A robot whose IMU is not read: its tilt stands still while its time goes on."""

    def __init__(self, control_period=0.02, falls_silent_after=10**6):
        self.control_period, self._left, self._time = control_period, falls_silent_after, 0.0

    def reset(self, trial):
        self._time = 0.0
        return Observation(self._time, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0)

    def step(self, command):
        self._left -= 1
        if self._left < 0:
            raise LinkLostError("It fell silent.")
        self._time += self.control_period
        moved = 1e-3 * self._left if self._left < 1000 else 0.0
        return Observation(self._time, 0.1 + 1e-3 * moved, 0.0, 0.0, 0.0, 0.0, 0.0)

    def stop(self):
        pass

    def close(self):
        pass


def test_a_robot_whose_imu_is_frozen_is_no_success(policy):
    with pytest.raises(LinkError, match=r"the same for 0\.1"):
        twbal.evaluate(policy, plant=Unread(), trials=1)


def test_a_robot_that_falls_silent_is_a_link_that_was_lost(policy):
    with pytest.raises(LinkError, match="It fell silent"):
        twbal.evaluate(policy, plant=Unread(falls_silent_after=4), trials=1)


def test_a_robot_of_another_control_period_is_not_driven(policy):
    for drive in (lambda plant: twbal.evaluate(policy, plant=plant), twbal.learn):
        with pytest.raises(ConfigError, match=r"control period of 0\.005 s; the data sheet 'paper' says 0\.02 s"):
            drive(Unread(0.005))


def test_a_robot_on_a_link_that_takes_less_than_its_sheet_says_is_not_driven(policy):
    stronger = replace(twbal.robot(), torque_limit=40.0)
    with twbal.connect() as plant, pytest.raises(ConfigError, match=r"takes at most 20 N·m.*says 40 N·m"):
        twbal.evaluate(policy, stronger, plant=plant)


def test_each_trial_is_told_in_simulation_too(policy):
    told = []
    found = twbal.evaluate(policy, trials=2, overrides=SHORT, tell=told.append)
    assert tuple(told) == found.episodes


class Resting(Policy):
    """Commands nothing."""

    def controller(self, rng):
        return lambda state: 0.0


HELD = {"name": "held", "torque_limit": 4.0}
SHORT = ["success.duration=1.2", "success.settle_time=0.6", "success.place_time=0", "success.place_radii=null"]
SHORT.append("search.horizon=60")


def driven_over_a_port(robot):
    """Trials of a robot behind a port that does nothing."""
    with served(Firmware(robot, Identity("held", 4.0, 1.0, 0.1, Clock.LOCKSTEP))) as port:
        link = ["link.confirm_placed=null", "link.timeout=5"]
        sheet = replace(twbal.robot(), **HELD)
        with twbal.connect(port, sheet, link, heed_check=False) as plant:
            return twbal.evaluate(Resting(), sheet, plant=plant, trials=2, overrides=SHORT)


@pytest.fixture
def own_handlers():
    """Handlers of whoever calls the library; those signals that came to them."""
    numbers, came = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP), []
    before = {number: signal.signal(number, lambda number, frame: came.append(number)) for number in numbers}
    yield came
    for number, handler in before.items():
        signal.signal(number, handler)


def test_trials_that_ended_are_told_of_where_a_later_one_breaks_off():
    robot, seen = HeldRobot(), []

    def broken_off(trial):
        raise KeyboardInterrupt

    with served(Firmware(robot, Identity("held", 4.0, 1.0, 0.1, Clock.LOCKSTEP))) as port:
        sheet = replace(twbal.robot(), **HELD)
        with twbal.connect(port, sheet, ["link.confirm_placed=null", "link.timeout=5"], heed_check=False) as plant:
            arm, plant.reset = plant.reset, lambda trial: broken_off(trial) if trial == 1 else arm(trial)
            with pytest.raises(KeyboardInterrupt):
                twbal.evaluate(Resting(), sheet, plant=plant, trials=2, overrides=SHORT, tell=seen.append)
    assert [episode.provenance.trial for episode in seen] == [0]


class Signalled(HeldRobot):
    """Sends this process a signal in its first trial, and tells of its stops."""

    def __init__(self, number):
        super().__init__()
        self.number, self.stops = number, 0

    def step(self, command):
        if self._periods == 10:
            os.kill(os.getpid(), self.number)
        return super().step(command)

    def stop(self):
        self.stops += 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_stops_a_robot_on_a_port_and_is_heard_as_before_after_that(number, own_handlers):
    robot = Signalled(number)
    with pytest.raises(KeyboardInterrupt):
        driven_over_a_port(robot)
    assert robot.stops == 1
    assert own_handlers == []
    os.kill(os.getpid(), number)
    assert own_handlers == [number]


@pytest.mark.slow
def test_a_signal_stops_a_robot_that_is_learned_on(own_handlers):
    quick = ["sim_collect.rollouts=6", "sim_rounds=0", "ensemble=none", "updates=0", "trials=1"]
    quick += ["calibration_rollouts=0", "search.horizon=20", "search.restarts=1", "search.iterations=5"]
    quick += ["validation.robots=3", "parametrisation.basis=5"]
    robot = Signalled(signal.SIGTERM)
    with served(Firmware(robot, Identity("held", 20.0, 1.0, 0.1, Clock.LOCKSTEP))) as port:
        link = ["link.confirm_placed=null", "link.timeout=5"]
        with twbal.connect(port, overrides=link, heed_check=False) as plant, pytest.raises(KeyboardInterrupt):
            twbal.learn(plant, "paper", quick)
    assert robot.stops == 1
    assert own_handlers == []


def test_outside_of_the_main_thread_no_handler_is_set(own_handlers):
    robot, found = Signalled(signal.SIGTERM), []
    thread = threading.Thread(target=lambda: found.append(driven_over_a_port(robot)))
    thread.start()
    thread.join()
    assert found[0].trials == 2
    assert own_handlers == [signal.SIGTERM] * 2


def test_a_policy_that_commands_more_than_the_sheet_allows_is_not_driven(policy):
    weaker = replace(twbal.robot(), torque_limit=5.0)
    with pytest.raises(ConfigError, match=r"commands up to 20 N·m; the robot 'paper' takes 5 N·m"):
        twbal.evaluate(policy, weaker, plant=Unread(), trials=1)


def test_what_cannot_be_driven_is_one_clear_error(policy):
    with pytest.raises(LinkError, match="there_is_no_such_port"):
        twbal.connect("/dev/there_is_no_such_port").__enter__()


@pytest.mark.parametrize("name", ["learn", "diagnose", "evaluate", "evaluate_simulation", "simulate"])
def test_ctrl_c_is_heard_as_where_kernels_run(name, monkeypatch):
    heard = []

    def look(*_):
        heard.append(signal.getsignal(signal.SIGINT))
        raise ConfigError("seen")

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    for module in ("diagnosing", "driving", "evaluating", "learning"):
        for check in ("check_whole", "check_progress", "check_plant"):
            monkeypatch.setattr(f"twbal.api.{module}.{check}", look, raising=False)
    try:
        with pytest.raises(ConfigError, match="seen"):
            getattr(twbal, name)(*{"simulate": ()}.get(name, ("policy", "episodes")))
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard[0] is not signal.default_int_handler
