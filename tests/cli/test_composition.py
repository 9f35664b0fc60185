import copy

import pytest
from hydra.core.config_store import ConfigStore

from twbal.cli.composition import composing, scaled

SIZES = {"wheel_radius": 0.15, "com_height": 0.3, "body_mass": 10.0, "body_inertia_pitch": 0.319}  # of `paper`
UNITS = {"m": (1, 0), "m.s": (1, 1), "m/s": (1, -1), "rad/s": (0, -1)}  # powers of length and of time


@pytest.mark.parametrize("unit", UNITS)
def test_a_robot_of_a_quarter_of_the_size_falls_in_half_the_time(unit):
    """Dynamic similarity under gravity: times go by the square root of lengths, inertias by mass and length squared."""
    assert scaled(2.5, unit, SIZES) == 2.5
    small = {
        "wheel_radius": 0.15 / 4,
        "com_height": 0.3 / 4,
        "body_mass": 10.0 / 64,
        "body_inertia_pitch": 0.319 / 64 / 16,
    }
    length, time = UNITS[unit]
    assert scaled(2.5, unit, small) == pytest.approx(2.5 * 0.25**length * 0.5**time, rel=1e-12)


def test_copies_of_hydras_store_share_what_twbal_registers_and_each_composition_has_its_own():
    with composing():
        store = ConfigStore.instance()
        shared = store.repo["cost"]["paper.yaml"]
        assert copy.deepcopy(store).repo["cost"]["paper.yaml"] is shared  # a help text makes 180 such copies
        first, before = store.load("cost/paper.yaml").node, copy.deepcopy(shared.node)
        first[next(iter(first))] = None
        assert store.load("cost/paper.yaml").node == before
