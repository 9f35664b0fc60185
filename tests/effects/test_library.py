"""All effects are found, say what is known of them, and name others that exist."""

import re
from pathlib import Path

import numpy as np
import pytest

import twbal.effects
from twbal.effects.effect import ActuatorEffect
from twbal.effects.library import all_effects, library
from twbal.effects.parameter import Scale, parameters_of

ACTUATORS = [name for name, effect in library().items() if issubclass(effect, ActuatorEffect)]


def test_every_effect_that_can_be_named_is_found_and_the_sensors_noise_is_none_of_them():
    found = library()
    files = {path.stem for path in Path(twbal.effects.__file__).parent.glob("*.py")}
    assert set(all_effects()) == files - {"__init__", "definition", "effect", "library", "effects_page", "parameter"}
    assert {"coulomb_friction", "imu_delay", "wheel_slip"} < set(found)
    assert "sensor_noise" not in found


@pytest.mark.parametrize("name", library())
def test_an_effect_says_what_it_is_like_and_names_only_others(name):
    effect = library()[name]
    assert set(effect.nearly_same_as) <= set(library()) - {name}
    assert effect.separate_by.endswith(".")
    assert parameters_of(effect)


@pytest.mark.parametrize("name", all_effects())
def test_an_effect_has_a_reference_with_its_year_and_each_parameter_a_meaning(name):
    effect = all_effects()[name]
    assert re.search(r"(19|20)\d\d[.,]", effect.reference)
    assert all(parameter.meaning for parameter in parameters_of(effect).values())
    assert isinstance(effect.is_linear, bool)


@pytest.mark.parametrize("name", ACTUATORS)
def test_an_actuator_says_whether_it_remembers(name):
    kind = library()[name]
    effect = kind(**{parameter: known.start for parameter, known in parameters_of(kind).items()})
    fresh, used = (effect.start(0.001, np.random.default_rng(0)) for _ in range(2))
    for torque in (9.0, -4.0, 0.0, 3.0):
        used(torque)
    differs = any(fresh(torque) != used(torque) for torque in np.linspace(5.0, -1.0, 60))
    assert differs == effect.remembers


def test_forces_and_torques_grow_with_the_robot():
    unscaled = [
        f"{name}.{key}"
        for name, effect in library().items()
        for key, p in parameters_of(effect).items()
        if p.unit.startswith("N") and p.scale is Scale.NOTHING
    ]
    assert unscaled == []


def test_a_force_has_the_same_range_over_the_weight_on_robots_of_all_sizes(paper, regbot):
    sizes = {}
    for robot in (paper, regbot):
        mass = robot.body_mass + 2.0 * robot.wheel_mass
        force = parameters_of(library()["periodic_disturbance"])["force"]
        sizes[robot.name] = force.start * force.size(robot) / (9.81 * mass)
    assert sizes[paper.name] == pytest.approx(sizes[regbot.name], rel=1e-12)
