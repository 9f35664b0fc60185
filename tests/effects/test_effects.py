from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hydra.utils import instantiate

from twbal.core.errors import ConfigError
from twbal.core.plant import Observation
from twbal.core.start_pose import StartPose
from twbal.effects.actuation_delay import ActuationDelay
from twbal.effects.backlash import Backlash
from twbal.effects.backlash_behind_encoder import BacklashBehindEncoder
from twbal.effects.body_mass import BodyMass
from twbal.effects.com_height import ComHeight
from twbal.effects.com_offset import ComOffset
from twbal.effects.coulomb_friction import CoulombFriction
from twbal.effects.dead_zone import DeadZone
from twbal.effects.effect import assemble, torque_left
from twbal.effects.friction_compensation import FrictionCompensation
from twbal.effects.library import all_effects, nodes, values_of
from twbal.effects.motor_lag import MotorLag
from twbal.effects.parameter import parameters_of
from twbal.effects.sensor_noise import SensorNoise
from twbal.effects.stribeck_friction import StribeckFriction
from twbal.effects.torque_gain import TorqueGain
from twbal.effects.viscous_friction import ViscousFriction
from twbal.planar.planar_plant import PlanarPlant
from twbal.sim.bullet_plant import SimPlant

H = 0.001


def run(effect, torques, physics_step=H):
    link = effect.start(physics_step, np.random.default_rng(0))
    return np.array([link(u) for u in torques])


@pytest.mark.parametrize("name", nodes())
def test_a_choice_of_the_configuration_makes_an_effect_of_its_name_that_starts_away_from_nothing(name):
    effect = instantiate(nodes()[name])
    assert type(effect) is all_effects()[name]
    assert type(effect).__module__ == f"twbal.effects.{name}"
    for key, known in parameters_of(type(effect)).items():
        assert known.low <= getattr(effect, key) <= known.high
        assert known.low <= known.start <= known.high
    size, known = next(iter(parameters_of(type(effect)).items()))
    assert getattr(effect, size) != known.neutral


NONSENSE = [
    (DeadZone, -1.0),
    (TorqueGain, -0.1),
    (CoulombFriction, -1.0),
    (ViscousFriction, float("nan")),
    (ActuationDelay, -0.01),
    (MotorLag, float("inf")),
    (BodyMass, 0.0),
    (ComHeight, 0.0),
    (ComOffset, 5.0),
]


@pytest.mark.parametrize(("kind", "value"), NONSENSE)
def test_an_impossible_value_is_refused(kind, value):
    with pytest.raises(ConfigError, match=f"effect {kind.__name__} must lie within .* found {value}"):
        kind(value)


@pytest.mark.parametrize("name", all_effects())
@pytest.mark.parametrize("value", ["a", "1.0", None, [1.0]])
def test_a_value_that_is_no_number_is_told(name, value):
    kind = all_effects()[name]
    first, *others = parameters_of(kind)
    values = {first: value, **{other: parameters_of(kind)[other].value for other in others}}
    with pytest.raises(ConfigError, match=rf"{first} of effect {kind.__name__} must be a number; found ") as caught:
        kind(**values)
    assert str(caught.value).endswith(f"found {value!r}.")


def test_dead_zone_is_odd_continuous_and_flat_inside():
    u = np.linspace(-4, 4, 801)
    out = run(DeadZone(1.5), u)
    np.testing.assert_allclose(out, np.sign(u) * np.maximum(np.abs(u) - 1.5, 0), atol=1e-15)
    assert np.abs(np.diff(out)).max() <= u[1] - u[0] + 1e-12


def test_a_skewed_dead_zone_is_wider_forward_and_as_much_narrower_backward():
    u = np.linspace(-4, 4, 801)
    expected = np.where(u > 0, np.maximum(u - 1.8, 0), np.minimum(u + 1.2, 0))
    np.testing.assert_allclose(run(DeadZone(1.5, 0.2), u), expected, atol=1e-15)


def test_friction_compensation_adds_in_the_direction_of_the_command_and_nothing_to_none():
    out = run(FrictionCompensation(0.4), [-2.0, -1e-9, 0.0, 1e-9, 2.0])
    np.testing.assert_allclose(out, [-2.4, -0.4, 0.0, 0.4, 2.4], rtol=1e-8)


def test_a_dead_zone_of_the_same_size_undoes_friction_compensation():
    u = np.linspace(-4, 4, 801)
    compensated = run(FrictionCompensation(1.5), u)
    np.testing.assert_allclose(run(DeadZone(1.5), compensated), u, atol=1e-12)


def test_a_delay_of_whole_steps_shifts_the_torque():
    u = np.random.default_rng(1).standard_normal(100)
    assert np.array_equal(run(ActuationDelay(0.03), u), np.r_[np.zeros(30), u[:70]])
    assert np.array_equal(run(ActuationDelay(0.0), u), u)


@pytest.mark.parametrize("delay", [0.0004, 0.0137, 0.02951])
def test_a_delay_keeps_the_impulse_of_the_held_torque_exactly(delay):
    u = np.random.default_rng(2).standard_normal(100)
    applied = H * run(ActuationDelay(delay), u).cumsum()
    ends = H * np.arange(1, 101) - delay
    integral = np.interp(ends, H * np.arange(101), np.r_[0, H * u.cumsum()], left=0)
    np.testing.assert_allclose(applied, integral, atol=1e-12)


def test_motor_lag_follows_its_differential_equation():
    impulse = H * run(MotorLag(0.04), np.full(100, 2.0)).cumsum()
    times = H * np.arange(1, 101)
    np.testing.assert_allclose(impulse, 2 * (times + 0.04 * np.expm1(-times / 0.04)), rtol=1e-9)
    assert np.array_equal(run(MotorLag(0.0), [1.0, -3.0]), [1.0, -3.0])


def test_what_an_effect_remembers_ends_with_its_rollout():
    for effect in (ActuationDelay(0.0035), MotorLag(0.02)):
        assert np.array_equal(run(effect, np.arange(9.0)), run(effect, np.arange(9.0)))


def test_noise_has_the_stated_spread_on_every_channel_and_leaves_the_clock_alone():
    sd = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    sense = SensorNoise(*sd).start(0.02, np.random.default_rng(3))
    truth = Observation(1.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    seen = np.array([sense(truth) for _ in range(4000)])
    assert (seen[:, 0] == 1.5).all()
    noise = seen[:, 1:] - np.array(truth[1:])
    np.testing.assert_allclose(np.cov(noise.T), np.diag(sd**2), atol=0.02)
    assert np.all(np.abs(noise.mean(0)) < 4 * sd / np.sqrt(4000))


def test_body_effects_change_what_they_name_and_nothing_else(paper):
    changed = assemble(paper, [BodyMass(1.5), ComHeight(0.8), ComOffset(0.05)]).robot
    expected = replace(
        paper,
        body_mass=1.5 * paper.body_mass,
        body_inertia_pitch=1.5 * paper.body_inertia_pitch,
        body_inertia_roll=1.5 * paper.body_inertia_roll,
        body_inertia_yaw=1.5 * paper.body_inertia_yaw,
        com_height=0.8 * paper.com_height,
        com_offset=0.05,
    )
    assert changed == expected


def test_effects_act_at_their_place_in_whatever_order_they_are_listed(paper):
    effects = [DeadZone(1.0), TorqueGain(0.5), ActuationDelay(0.002), MotorLag(0.01)]
    outputs = []
    for order in permutations(effects):
        effect_state = assemble(paper, order).start(H, np.random.default_rng(0))
        outputs.append([effect_state.actuate(u) for u in (4.0, -3.0, 2.0, 0.5, -0.2)])
    assert all(o == outputs[0] for o in outputs)
    delayed = np.array([0, 0, 4.0, -3.0, 2.0])
    np.testing.assert_allclose(
        outputs[0], run(MotorLag(0.01), 0.5 * np.sign(delayed) * np.maximum(abs(delayed) - 1, 0))
    )


def test_another_effect_does_not_change_the_noise(paper):
    noise = SensorNoise(1, 1, 1, 1, 1, 1)
    truth = Observation(*[0.0] * 7)
    alone = assemble(paper, [noise]).start(H, np.random.default_rng(0)).sense(truth)
    beside = (
        assemble(paper, [noise, CoulombFriction(0.1), BodyMass(1.1)]).start(H, np.random.default_rng(0)).sense(truth)
    )
    assert alone == beside


def test_a_robot_has_play_on_one_side_of_its_encoders_only(paper):
    with pytest.raises(ConfigError, match="leave one of the effects"):
        assemble(paper, [Backlash(0.05), BacklashBehindEncoder(0.02)])


@pytest.mark.parametrize("effects", [[DeadZone(1.0), DeadZone(0.5)], [BodyMass(1.1), DeadZone(1.0), BodyMass(1.1)]])
def test_two_effects_of_one_kind_are_refused_by_both_simulations(paper, effects):
    """The physics engine would have both, and the planar model one."""
    settings = {"robot": paper, "start": StartPose(0.0, 0.0, 0.0, 0.0), "physics_step": H, "seed": 0}
    said = f"the effect {type(effects[0]).__name__} twice; give one"
    for refusing in (lambda: assemble(paper, effects), lambda: values_of(effects)):
        with pytest.raises(ConfigError, match=said):
            refusing()
    for simulation in (SimPlant, PlanarPlant):
        with pytest.raises(ConfigError, match=said):
            simulation(effects=effects, **settings)


NEVER_TURN = {
    "dead zone": [DeadZone(1.0)],
    "dead zone, forward alone": [DeadZone(0.4, 0.4)],
    "dry friction": [CoulombFriction(0.25)],
    "dry friction at rest": [StribeckFriction(0.1, 0.2, 2.0)],
    "dead zone and friction": [DeadZone(0.3), CoulombFriction(0.1)],
    "weak motors and friction": [TorqueGain(0.5), CoulombFriction(0.15)],
}
TURN = {
    "nothing": [],
    "dead zone": [DeadZone(0.4)],
    "dry friction": [CoulombFriction(0.2)],
    "dead zone and compensation": [DeadZone(0.6), FrictionCompensation(0.3)],
}


def turned_by(robot, effects, sign):
    """Angle by which the planar model's wheels turn, forward positive, at rest under the largest command."""
    start = StartPose(0.0, 0.0, 0.0, 0.0)
    with PlanarPlant(robot=robot, effects=effects, start=start, physics_step=H, seed=0) as plant:
        plant.reset(0)
        for _ in range(5):
            plant.step(sign * robot.torque_limit)
        return sign * (plant._state.position / robot.wheel_radius)


@pytest.mark.parametrize("kind", NEVER_TURN)
def test_where_nothing_is_left_of_the_torque_limit_the_wheels_stand(regbot, kind):
    assert torque_left(regbot, NEVER_TURN[kind]) <= 0.0
    assert min(turned_by(regbot, NEVER_TURN[kind], sign) for sign in (1.0, -1.0)) < 1e-6


@pytest.mark.parametrize("kind", TURN)
def test_where_something_is_left_of_it_they_turn(regbot, kind):
    assert torque_left(regbot, TURN[kind]) > 0.0
    assert min(turned_by(regbot, TURN[kind], sign) for sign in (1.0, -1.0)) > 0.01


def test_all_of_a_friction_at_rest_is_of_each_wheel():
    known = parameters_of(StribeckFriction)
    assert known["torque"].is_of_each_wheel and known["breakaway"].is_of_each_wheel
