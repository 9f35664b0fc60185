from dataclasses import fields, replace

import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import parameter_hash
from twbal.effects.body_inertia import BodyInertia
from twbal.effects.body_mass import BodyMass
from twbal.effects.com_height import ComHeight

NUMBERS = ["body_mass", "com_height", "body_inertia_pitch", "wheel_radius", "track", "torque_limit", "control_period"]


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_a_value_that_no_robot_has_is_refused_by_name(paper, name, value):
    with pytest.raises(ConfigError, match=f"{name} of robot 'paper' must be positive and finite; found {value}"):
        replace(paper, **{name: value})


def test_an_offset_in_degrees_is_suspected(paper):
    with pytest.raises(ConfigError, match="in degrees"):
        replace(paper, com_offset=5.0)


@pytest.mark.parametrize(("name", "value"), [("body_mass", 1e-300), ("com_height", 1e300), ("track", 1e-12)])
def test_a_value_in_other_units_is_suspected(paper, name, value):
    with pytest.raises(ConfigError, match=f"{name} of robot 'paper' must lie between 1e-09 and 1e\\+09 in SI units"):
        replace(paper, **{name: value})


@pytest.mark.parametrize("largest", ["body_inertia_roll", "body_inertia_pitch", "body_inertia_yaw"])
def test_inertias_that_no_body_has_are_refused_by_name(paper, largest):
    """Of point masses, Ixx = Σ m (y² + z²) and so on: the sum of two exceeds the third by 2 Σ m x²."""
    inertias = dict.fromkeys(("body_inertia_roll", "body_inertia_pitch", "body_inertia_yaw"), 0.2)
    replace(paper, **{**inertias, largest: 0.4})  # a flat plate
    with pytest.raises(ConfigError, match=f"{largest} of robot 'paper' is 0.401 kg·m², more than .* together"):
        replace(paper, **{**inertias, largest: 0.401})


def test_any_distribution_of_masses_is_accepted_and_so_is_what_effects_make_of_it(paper):
    rng = np.random.default_rng(5)
    for flat in (1.0, 0.0):
        for _ in range(50):
            x, y, z = rng.normal(size=(3, 6)) * np.array([[1.0], [1.0], [flat]])
            roll, pitch, yaw = (y**2 + z**2).sum(), (x**2 + z**2).sum(), (x**2 + y**2).sum()
            sheet = replace(paper, body_inertia_roll=roll, body_inertia_pitch=pitch, body_inertia_yaw=yaw)
            for effect in (BodyMass, BodyInertia, ComHeight):
                assert effect(float(rng.uniform(0.3, 3.0))).alter(sheet) != sheet


def test_robots_of_the_data_sheets_obey_the_triangle_inequality(paper, regbot):
    for robot in (paper, regbot):
        inertias = sorted([robot.body_inertia_pitch, robot.body_inertia_roll, robot.body_inertia_yaw])
        assert inertias[0] + inertias[1] >= inertias[2]


def test_hash_changes_with_every_value(paper):
    seen = {
        parameter_hash(paper, [], 0.001),
        parameter_hash(paper, [], 0.0005),
        parameter_hash(paper, [BodyMass(1.1)], 0.001),
    }
    values = [field for field in fields(paper) if field.compare]
    for field in values:
        value = getattr(paper, field.name)
        other = value + "_2" if isinstance(value, str) else value + 1e-9
        seen.add(parameter_hash(replace(paper, **{field.name: other}), [], 0.001))
    assert len(seen) == 3 + len(values)


def test_hash_tells_effects_with_equal_values_apart(paper):
    assert parameter_hash(paper, [BodyMass(1.1)], 0.001) != parameter_hash(paper, [ComHeight(1.1)], 0.001)


def test_hash_ignores_order_and_kind_of_number(paper):
    one, other = BodyMass(2.0), ComHeight(1.1)
    expected = parameter_hash(paper, [one, other], 0.001)
    assert parameter_hash(paper, [other, BodyMass(2)], np.float64(0.001)) == expected


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int64])
def test_a_number_of_numpy_becomes_one_of_python(paper, kind):
    found = replace(paper, body_mass=kind(11), torque_limit=kind(20))
    assert (type(found.body_mass), found.body_mass, type(found.torque_limit)) == (float, 11.0, float)
    assert parameter_hash(found) == parameter_hash(replace(paper, body_mass=11.0, torque_limit=20.0))


@pytest.mark.parametrize("name", ["${x}", "my ${robot.name}", 3, None])
def test_a_name_that_settings_would_take_for_a_reference_is_refused(paper, name):
    with pytest.raises(ConfigError, match=r"name of a robot must be a text without \$\{"):
        replace(paper, name=name)
