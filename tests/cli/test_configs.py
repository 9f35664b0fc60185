"""Every yaml of conf/ is composed, and what it describes is built."""

from functools import cache

import pytest
from hydra import compose
from hydra.errors import ConfigCompositionException
from hydra.utils import instantiate
from omegaconf import OmegaConf

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
    (place.relative_to("groups").with_suffix("").as_posix(), str(option))
    for place in PLACES
    if place.parts[0] == "groups"
    for option in OmegaConf.load(CONF / place)
]
OPTIONS.sort()
NEEDED = {
    "policy.path": "p.pt",
    "link.port": "/dev/null",
    "episodes": "e",
    "dynamics": "m.pt",
    "files": "l.csv",
    "episode": "e.mcap",
    "logs": "l.mcap",
    "runs": "[r]",
    "name": "my_robot",
}
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
    return [f"{key}={NEEDED[key]}" for key in missing(cfg)]


@cache
def choices(name):
    """Groups of an entry, and what is chosen of each."""
    return dict(compose(name, return_hydra_config=True).hydra.runtime.choices)


def composes(name, word):
    try:
        compose(name, [word])
    except ConfigCompositionException:
        return False
    return True


@pytest.mark.parametrize("name", ENTRIES)
def test_an_entry_belongs_to_a_stage_and_resolves_once_told_what_it_needs(name):
    assert name.replace("_", "-") in STAGES
    cfg = compose(name, told(compose(name)))
    assert recorded(cfg, ())
    assert compose(name, return_hydra_config=True).hydra.job.name == name.replace("_", "-")


@pytest.mark.parametrize(("group", "option"), OPTIONS, ids="/".join)
def test_an_option_can_be_chosen_and_built(group, option):
    users = [name for name in ENTRIES if group in choices(name)]
    if group == "task":  # not chosen: every user of it has it
        entry, word, node = "optimise_policy", "seed=1", option
    elif users:
        word, node = f"{group}={option}", group.replace("/", ".")
        entry = next(name for name in users if composes(name, word))  # an experiment is of one stage
    else:
        entry, word, node = "sim_collect", f"+{group}@probe={option}", "probe"
    cfg = compose(entry, [word])
    cfg = compose(entry, [word, *told(cfg)])
    if group in ("experiment", "method") or option == "limit":  # are values of the whole configuration
        return
    only_arguments = group in OPENS or f"{group}/{option}" in OPENS
    built = instantiate(OmegaConf.select(cfg, node), **({"_partial_": True} if only_arguments else {}))
    assert callable(built) if only_arguments else built is not None
