"""Rollouts and trials by the library are those of the commands, and of the robot that is asked for."""

import signal
from dataclasses import replace

import numpy as np
import pytest

import twbal
from twbal.cli.main import main
from twbal.core.errors import ConfigError, LinkError, LinkLostError
from twbal.core.plant import Observation, Plant
from twbal.effects.dead_zone import DeadZone
from twbal.effects.torque_gain import TorqueGain

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
