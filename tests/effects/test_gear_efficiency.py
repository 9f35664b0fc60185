"""The loss of gears, by the powers on both of their sides."""

import numpy as np
import pytest

from twbal.core.robot_model import JointMotion
from twbal.effects.gear_efficiency import GearEfficiency


def passed(effect, torque, rate):
    return effect.turn(torque, JointMotion(0.0, rate))


@pytest.mark.parametrize("loss", [0.05, 0.3])
@pytest.mark.parametrize("rate", [-4.0, 4.0])
@pytest.mark.parametrize("torque", [-2.0, 2.0])
def test_the_side_that_takes_the_power_gets_the_efficiency_times_what_the_other_gives(loss, rate, torque):
    motor, wheel = torque * rate, passed(GearEfficiency(loss), torque, rate) * rate
    given, taken = (motor, wheel) if motor > 0.0 else (-wheel, -motor)
    assert given > 0.0
    assert taken / given == pytest.approx(1.0 - loss, rel=1e-6)


def test_gears_never_give_power_and_lose_none_where_nothing_turns():
    effect = GearEfficiency(0.3)
    torques, rates = np.meshgrid(np.linspace(-3.0, 3.0, 61), np.linspace(-2.0, 2.0, 81))
    lost = np.array([(t - passed(effect, t, w)) * w for t, w in zip(torques.ravel(), rates.ravel(), strict=True)])
    assert (lost >= 0.0).all()
    assert passed(effect, 2.0, 0.0) == 2.0


def test_it_is_continuous_where_the_power_changes_its_sign():
    effect, e = GearEfficiency(0.3), 1e-9
    for torque, rate in ((0.0, 1.5), (2.0, 0.0), (0.0, 0.0)):
        around = [passed(effect, torque + a, rate + b) for a in (-e, e) for b in (-e, e)]
        assert np.ptp(around) < 1e-7


def test_it_is_the_same_forward_and_backward():
    effect = GearEfficiency(0.2)
    for torque, rate in ((1.0, 0.1), (1.0, -0.1), (2.0, 3.0)):
        assert passed(effect, -torque, -rate) == -passed(effect, torque, rate)
