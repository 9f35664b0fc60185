"""Every number of a configuration stands once: who changes it changes it wherever it holds."""

from collections import defaultdict

import pytest
from hydra import compose
from omegaconf import OmegaConf

from twbal.cli.composition import composing
from twbal.cli.conf_folder import conf_folder

ENTRIES = sorted(path.stem for path in conf_folder().glob("*.yaml") if path.stem != "base")
SMALL = (0, 1, -1, 2, 3)  # counts and seeds, which are equal by chance
EQUAL_BY_CHANCE = (
    ("cost.widths", "agent.scales"),  # what costs alike, and what a network sees alike
    ("model.fit_f", "model.fit_g"),  # of two searches, from one file
    ("model.smoothing.iterations", "search.iterations"),
    ("trials", "train_agent."),
)


def numbers(node, prefix=""):
    """Every number that is written out, by its dotted key."""
    for key, value in node.items():
        if isinstance(value, dict):
            yield from numbers(value, f"{prefix}{key}.")
        elif type(value) in (int, float) and value not in SMALL:
            yield f"{prefix}{key}", value


def by_chance(keys):
    return any(all(key.startswith(pair) for key in keys) for pair in EQUAL_BY_CHANCE)


@pytest.mark.parametrize("entry", ENTRIES)
def test_no_number_of_one_name_stands_in_two_places(entry):
    found = defaultdict(list)
    with composing():
        for key, value in numbers(OmegaConf.to_container(compose(entry))):
            found[key.split(".")[-1], value].append(key)
    again = [keys for keys in found.values() if len(keys) > 1]
    assert [keys for keys in again if not by_chance(keys)] == []
