"""The benchmark of free forms: its truth is what the mechanics add to a robot, and its tables count what they say."""

import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate

from benchmarks.free_form.tables import free_form, free_form_figures
from benchmarks.free_form.truth import comparable, hidden_function
from benchmarks.other_robots.drive import Sensors
from benchmarks.other_robots.kinds import ALL, drawn_values, put
from benchmarks.other_robots.mechanics import LEFT, SIZE, SPIN_L, WAY, V, joint, push
from benchmarks.other_robots.robots import nominal
from twbal.cli.composition import composing

SENSORS = Sensors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1000.0, 0.0, 0.0)
PLACE = {"wheel rate": SPIN_L, "wheel angle": LEFT, "speed": V, "position": WAY}


@pytest.fixture(scope="module")
def sheet():
    with composing():
        return instantiate(compose("sim_collect", ["robot=paper"]).robot)


def robots(name, sheet):
    """A robot without and one with something hidden."""
    plain = nominal(sheet)
    values = drawn_values(name, 1.0, sheet, np.random.default_rng(1))
    return plain, *put(name, values, plain, SENSORS)


@pytest.mark.parametrize(
    "name", ["cubic_friction", "viscous_friction", "notch", "quadratic_drag", "spring_stop", "gust"]
)
def test_the_truth_is_what_the_mechanics_add(name, sheet):
    plain, robot, sensors = robots(name, sheet)
    hidden = hidden_function(name, robot, sensors)
    values = np.linspace(-2.0, 2.0, 9) if hidden.variable != "time" else np.linspace(0.0, 10.0, 9)
    found = []
    for value in values:
        y, time = np.zeros(SIZE), 0.0
        if hidden.variable == "time":
            time = value
        else:
            y[PLACE[hidden.variable]] = value
        if hidden.quantity == "force at the axle":
            found.append(push(y, time, robot) - push(y, time, plain))
        else:  # of one joint, as both wheels stand and turn alike
            found.append(2.0 * (joint(y, 0, 0.0, 0.0, 0.0, robot)[0] - joint(y, 0, 0.0, 0.0, 0.0, plain)[0]))
    np.testing.assert_allclose(hidden.at(values), found, atol=1e-12)
    assert np.ptp(found) > 0.0


def test_a_comparable_truth_has_neither_mean_nor_of_the_command_a_line(sheet):
    for name, powers in (("quadratic_drag", 0), ("one_sided_motor", 1)):
        _, robot, sensors = robots(name, sheet)
        values = np.random.default_rng(0).uniform(-1.0, 2.0, 200)
        found = comparable(hidden_function(name, robot, sensors), values, values)
        for power in range(powers + 1):
            assert np.sum(found * values**power) == pytest.approx(0.0, abs=1e-9)


def test_every_hidden_kind_has_a_truth(sheet):
    from benchmarks.free_form.__main__ import IN_NO_LIBRARY, LEFT_OUT

    for name in (*IN_NO_LIBRARY, *LEFT_OUT):
        assert name in ALL
        _, robot, sensors = robots(name, sheet)
        assert np.isfinite(hidden_function(name, robot, sensors).at(np.array([-0.5, 0.5]))).all()


def test_the_tables_count_what_is_drawn_and_what_is_right():
    drawn = {"quantity": "force at the axle", "variable": "speed", "share": 0.4}
    row = {"kind": "in no library", "hidden": "quadratic_drag", "verdict": "unknown", "remains": True, "cpu_s": 1.0}
    right = row | {"drawn": drawn, "right": True, "error": 0.1, "covered": 0.9}
    wrong = row | {"drawn": drawn, "right": False}
    clean = {"kind": "nothing", "hidden": "", "verdict": "none", "remains": False, "drawn": None, "right": False}
    results = {"sets": [right, wrong, clean | {"cpu_s": 0.2}]}
    lines = free_form(results)
    assert lines[2] == (
        "| quadratic drag | in no library | unknown | yes | force at the axle over speed | yes | 10% | 90% | 40% |"
    )
    assert len(lines) == 4
    figures = "\n".join(free_form_figures(results))
    assert "| of these, quantity and variable are right | 1 of 2" in figures
    assert "| of all sets, one would be drawn | 2 of 2" in figures
    assert "0 of 1 (0-98 %) |" in figures
