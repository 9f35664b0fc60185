"""A motor's torque for its voltage, and the simulation of REGBOT that is made with its constants."""

import pytest
from hydra import compose
from hydra.utils import instantiate

from twbal.cli.composition import composing
from twbal.core.errors import ConfigError
from twbal.core.motor import Motor

MOTOR = Motor(resistance=2.0, torque_constant=0.05, gear=20.0, supply=12.0)


def test_the_command_is_the_torque_of_the_circuit_at_a_standstill():
    volts = 7.0
    current = volts / MOTOR.resistance
    assert MOTOR.torque_per_volt * volts == pytest.approx(MOTOR.gear * MOTOR.torque_constant * current)


def test_a_motor_that_cannot_be_is_refused():
    with pytest.raises(ConfigError, match="resistance must be positive"):
        Motor(0.0, 0.05, 20.0, 12.0)


def test_the_simulation_of_regbot_has_the_back_emf_of_its_motor():
    with composing():
        cfg = compose("import_log", ["files=x", "import=regbot", "robot=regbot"])
        motor, robot = instantiate(cfg["import"].motor), instantiate(cfg.robot)
        effects = compose("sim_collect", ["robot=regbot", "sim=regbot"]).sim.effects
    back_emf = (motor.gear * motor.torque_constant) ** 2 / motor.resistance
    friction = 6e-6 * motor.gear**2  # of the rotors
    assert effects.viscous_friction.coefficient == pytest.approx((back_emf + friction) / 2, rel=0.02)
    assert robot.torque_limit == pytest.approx(motor.torque_per_volt * motor.supply, rel=0.02)
    geared = 2.6e-6 * motor.gear**2
    assert effects.rotor_inertia.share == pytest.approx(geared / (2 * robot.wheel_inertia), abs=0.01)
