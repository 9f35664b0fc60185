"""Hydra's help of a stage, made from the table of settings."""

from hydra.core.global_hydra import GlobalHydra
from omegaconf import DictConfig, OmegaConf

from twbal.cli.settings.help_text import help_text

RESOLVER = "settings_help"
"""Name under which yaml asks for it: `${settings_help:}`."""
EFFECTS_RESOLVER = "effects_help"
"""Name under which yaml asks for the line on effects: `${effects_help:}`."""


def settings_help(_root_: DictConfig) -> str:
    """Choices and settings of the configuration in which this is asked for.

    Hydra takes what comes of it for a template, in which a dollar sign stands twice.
    """
    stage = str(_root_.hydra.job.name)
    tree = OmegaConf.to_container(OmegaConf.masked_copy(_root_, [str(name) for name in _root_ if name != "hydra"]))
    assert isinstance(tree, dict)
    plain = {str(name): value for name, value in tree.items()}
    return help_text(stage, plain, _choices(_root_)).replace("$", "$$")


def _choices(cfg: DictConfig) -> dict[str, tuple[str, list[str]]]:
    """Of each group that a stage chooses from, as they stand in its yaml: what is chosen, and what there is."""
    loader = GlobalHydra.instance().config_loader()
    found = {}
    for group, chosen in reversed(cfg.hydra.runtime.choices.items()):
        name = str(group)
        if not name.startswith(("hydra/", "stage/")) and "@" not in name:
            found[name] = (str(chosen), sorted(loader.get_group_options(name)))
    return found


def effects_help(_root_: DictConfig) -> str:
    """How an effect is added, as a whole line; "" for a stage without a simulation."""
    line = "+effect@sim.effects.<name>=<name> adds an effect to the simulation (docs/effects.md).\n"
    return line if "sim" in _root_ else ""


OmegaConf.register_new_resolver(RESOLVER, settings_help, replace=True)
OmegaConf.register_new_resolver(EFFECTS_RESOLVER, effects_help, replace=True)
