"""Every packaged configuration, composed once: each stage by itself, and each choice of each group in one stage."""

from functools import cache
from typing import Any, NamedTuple

from hydra import compose
from hydra.core.global_hydra import GlobalHydra
from omegaconf import OmegaConf

from twbal.cli.composition import composing
from twbal.cli.conf_folder import conf_folder
from twbal.effects.library import all_effects

CONF = conf_folder()
ENTRIES = sorted(path.stem for path in CONF.glob("*.yaml") if path.stem != "base")
GIVEN = {
    "policy.path": "p.pt",
    "link.port": "/dev/null",
    "episodes": "e",
    "dynamics": "m.pt",
    "files": "l.csv",
    "episode": "e.mcap",
    "logs": "l.mcap",
    "runs": ["r"],
    "name": "my_robot",
}
"""What a user must give."""


ONLY_IN = {"experiment=excite": "real_rollout", "experiment=drive": "real_rollout"}
"""Choices that are made for one of the stages that have the group."""


class Composed(NamedTuple):
    """A configuration.

    Attributes:
        stage: whose it is, as on the command line.
        words: that chose it.
        tree: plain values, resolved, with what a user must give.
        references: dotted keys that stand for a whole other part.
    """

    stage: str
    words: tuple[str, ...]
    tree: dict[str, Any]
    references: frozenset[str]


@cache
def all_composed() -> tuple[Composed, ...]:
    with composing():
        return tuple(_composed(*words) for words in _words())


def _words():
    options = {}
    for entry in ENTRIES:
        yield entry, ()
        for group, chosen in _by_itself(entry).hydra.runtime.choices.items():
            if not group.startswith(("hydra/", "stage/")) and "@" not in group:
                options.setdefault(group, (entry, chosen))
    for group, (entry, chosen) in options.items():
        names = GlobalHydra.instance().config_loader().get_group_options(group)
        words = ((name, f"{group}={name}") for name in names if name != chosen)
        yield from ((ONLY_IN.get(word, entry), (word,)) for _, word in words)
    yield "sim_collect", tuple(f"+effect@sim.effects.{effect}={effect}" for effect in all_effects())


@cache
def _by_itself(entry):
    return compose(entry, return_hydra_config=True)


def _composed(entry, words):
    whole = compose(entry, list(words)) if words else _by_itself(entry)
    cfg = OmegaConf.masked_copy(whole, [key for key in whole if key != "hydra"])
    OmegaConf.set_struct(cfg, False)
    for key, value in GIVEN.items():
        if OmegaConf.select(cfg, key, throw_on_missing=False) is None and _is_missing(cfg, key):
            OmegaConf.update(cfg, key, value)
    written = OmegaConf.to_container(cfg)
    return Composed(
        entry.replace("_", "-"), words, OmegaConf.to_container(cfg, resolve=True), frozenset(_references(written, cfg))
    )


def _is_missing(cfg, key):
    place, _, name = key.rpartition(".")
    node = OmegaConf.select(cfg, place) if place else cfg
    return OmegaConf.is_dict(node) and OmegaConf.is_missing(node, name)


def _references(written, cfg, prefix=""):
    for name, value in written.items():
        if isinstance(value, dict):
            yield from _references(value, cfg, f"{prefix}{name}.")
        elif str(value).startswith("${") and OmegaConf.is_dict(OmegaConf.select(cfg, f"{prefix}{name}")):
            yield f"{prefix}{name}"
