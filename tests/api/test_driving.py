"""Rollouts and trials by the library are those of the commands, and of the robot that is asked for."""

from dataclasses import replace

import numpy as np
import pytest

import twbal
from twbal.cli.main import main
from twbal.core.errors import ConfigError
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
