"""Every yaml of conf/ is composed, and what it describes is built."""

from functools import cache

import pytest
from hydra import compose
from hydra.errors import ConfigCompositionException
from hydra.utils import instantiate
from omegaconf import OmegaConf
from packaged_configurations import GIVEN

from twbal.cli.composition import composing
from twbal.cli.conf_folder import conf_folder
from twbal.cli.main import STAGES
from twbal.cli.typed_config import recorded

CONF = conf_folder()
ENTRIES = sorted(path.stem for path in CONF.glob("*.yaml") if path.stem != "base")
PLACES = [path.relative_to(CONF) for path in CONF.rglob("*.yaml")]
OPTIONS = [
    (place.parent.as_posix(), place.stem) for place in PLACES if place.parts[0] != "groups" and place.parent.name
]
OPTIONS += [
    tuple(f"{place.stem}/{key}".rsplit("/", 1))
    for place in PLACES
    if place.parts[0] == "groups"
    for key in OmegaConf.load(CONF / place)
]
OPTIONS.sort()
OPENS = {"link": "opens a port", "policy/saved": "reads a file"}  # built up to that


@pytest.fixture(autouse=True)
def within_composing():
    with composing():
        yield


def missing(cfg, prefix=""):
    """Dotted keys that a user must give."""
    for key in cfg:
        if OmegaConf.is_missing(cfg, key):
            yield f"{prefix}{key}"
        elif OmegaConf.is_dict(cfg._get_node(key)):
            yield from missing(cfg[key], f"{prefix}{key}.")


def told(cfg):
    return [f"{key}={GIVEN[key]}" for key in missing(cfg)]


@cache
def composition(name):
    """An entry as it is, with what Hydra says of it."""
    return compose(name, return_hydra_config=True)


def choices(name):
    """Groups of an entry, and what is chosen of each."""
    return composition(name).hydra.runtime.choices


@cache
def needed(name):
    """What an entry is to be told as it is."""
    cfg = composition(name)
    return told(OmegaConf.masked_copy(cfg, [key for key in cfg if key != "hydra"]))


def composed(name, word):
    """An entry with another choice and told what it needs; None where the choice is not for that entry."""
    try:
        cfg = compose(name, [word, *needed(name)])
    except ConfigCompositionException:  # or it does not need that
        try:
            cfg = compose(name, [word])
        except ConfigCompositionException:
            return None
    return compose(name, [word, *told(cfg)]) if told(cfg) else cfg


@pytest.mark.parametrize("name", ENTRIES)
def test_an_entry_belongs_to_a_stage_and_resolves_once_told_what_it_needs(name):
    assert name.replace("_", "-") in STAGES
    assert recorded(compose(name, needed(name)), ())
    assert composition(name).hydra.job.name == name.replace("_", "-")


@pytest.mark.parametrize(("group", "option"), OPTIONS, ids=["/".join(place) for place in OPTIONS])
def test_an_option_can_be_chosen_and_built(group, option):
    users = sorted((name for name in ENTRIES if group in choices(name)), key=lambda name: len(choices(name)))
    if group == "task":  # not chosen: every user of it has it
        cfg, node = composed("optimise_policy", "seed=1"), option
    elif users:
        found = (composed(name, f"{group}={option}") for name in users)  # an experiment is of one stage
        cfg, node = next(cfg for cfg in found if cfg is not None), group.replace("/", ".")
    else:
        cfg, node = composed("sim_collect", f"+{group}@probe={option}"), "probe"
    if group in ("experiment", "method") or option == "limit":  # are values of the whole configuration
        return
    only_arguments = group in OPENS or f"{group}/{option}" in OPENS
    built = instantiate(OmegaConf.select(cfg, node), **({"_partial_": True} if only_arguments else {}))
    assert callable(built) if only_arguments else built is not None


def test_nothing_sets_the_mode_of_hydra():
    """So that a command need not look for it; see `launch`."""
    for place in PLACES:
        whole = OmegaConf.load(CONF / place)
        parts = [whole, *(whole[choice] for choice in whole if place.parts[0] == "groups")]
        assert not any("mode" in part.get("hydra", {}) for part in parts if OmegaConf.is_dict(part)), place
