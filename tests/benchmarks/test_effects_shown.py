"""What recordings show of hidden effects where no search is made."""

from pathlib import Path

import pytest

from benchmarks.effects_shown.__main__ import shown
from benchmarks.effects_shown.tables import effects_shown
from benchmarks.other_robots.__main__ import Places, generate
from benchmarks.other_robots.sets import Set


@pytest.mark.slow
def test_a_large_effect_is_shown_and_one_that_does_next_to_nothing_is_not(tmp_path):
    effects = {"actuation_delay": 1.0, "viscous_friction": 1e-3}
    each = Set("pairs", 4, "E", 50, "paper", 0.03, "ideal", effects, ())
    places = Places(tmp_path, Path(), "shown", ())
    generate(each, places)
    found = shown(each, places)
    assert found["shown"]["actuation_delay"] > 100.0
    assert found["shown"]["viscous_friction"] < 5.0
    assert found["autocorrelation"] < 3.0


def test_the_table_counts_effects_that_are_worth_their_penalty():
    sets = [
        {"stratum": "eight", "seed": 1, "autocorrelation": 12.0, "shown": {"a": 19.9, "b": 20.0}},
        {"stratum": "eight", "seed": 2, "autocorrelation": 2.0, "shown": {"a": 300.0, "c": -1.0}},
        {"stratum": "eight", "seed": 3, "autocorrelation": None, "shown": {"a": 0.0}},
    ]
    (row,) = effects_shown({"sets": sets})[2:]
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[:2] == ["eight", "3"]
    assert cells[2].startswith("2 of 5 ")
    assert cells[3] == "7.0"
    assert cells[4].startswith("1 of 2 ")
    assert cells[5] == "1"
