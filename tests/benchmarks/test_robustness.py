"""The benchmark of what policies survive."""

import json

import numpy as np

from benchmarks.hidden_robots.data_sheet import regulator
from benchmarks.hidden_robots.families import FAMILIES
from benchmarks.hidden_robots.reference import drive
from benchmarks.hidden_robots.robots import Workshop
from benchmarks.robustness.__main__ import METHODS, perturbations
from benchmarks.robustness.integral_policy import IntegralPolicy
from benchmarks.robustness.tables import robustness
from twbal.algorithm.robustness import AxisLevels, Cell, MethodRobustness, PolicyRobustness, Robustness
from twbal.algorithm.rollout import rollout
from twbal.core.episode import Provenance
from twbal.core.json_records import encoded


def test_the_integral_regulator_commands_as_a_policy_what_it_commands_by_itself():
    shop = Workshop(FAMILIES["moderate"])
    policy, rule = IntegralPolicy(shop), shop.rules.default
    for trial in (2000, 2001):
        alone = drive(shop.robot(880), regulator(shop), trial, rule)
        provenance = Provenance("paper", "robot", trial=trial)
        through = rollout(shop.robot(880), policy, policy.channels, rule.steps, rule.tilt_limit, provenance)
        np.testing.assert_allclose(through.commands, alone.commands, atol=1e-6)


def test_levels_are_those_of_the_command_five_an_axis():
    asked = perturbations(3)
    assert asked.trials == 3
    assert {len(levels) for levels in asked.levels.values()} == {5}


def test_the_table_has_a_row_a_method():
    cells = {"delay": (Cell(0.01, 4, 3, 4, 4, 4, 3),)}
    policies = (PolicyRobustness("paper", 880, Cell(0.0, 4, 4, 4, 4, 4, 4), cells),)
    methods = tuple(MethodRobustness(name, policies) for name in METHODS)
    record = Robustness(0, 4, (AxisLevels("delay", "s", (0.01,)),), methods)
    head, rule, *rows = robustness(json.loads(json.dumps(encoded(record))))
    assert "delay" in head
    assert rule.count("---") == head.count("|") - 1
    assert [row.split(" | ")[0].strip("| ") for row in rows] == list(METHODS)
    assert all("75\u00a0%" in row for row in rows)
