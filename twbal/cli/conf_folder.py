"""Where the configuration lies: the yaml files of a checkout, an editable install or a wheel, and all effects."""

from pathlib import Path

from hydra.core.config_store import ConfigStore

from twbal.core.errors import ConfigError
from twbal.effects.library import nodes


def conf_folder() -> Path:
    """The folder of the yaml files, absolute; the group `effect`, which is made of the library, is told to Hydra.

    A wheel carries it inside the package; a checkout (and an editable install of one) has it beside the package.

    Raises:
        ConfigError: it is in neither place.
    """
    package = Path(__file__).resolve().parents[1]
    places = (package / "conf", package.parent / "conf")
    for place in places:
        if place.is_dir():
            _tell_effects()
            return place
    raise ConfigError(
        f"The configuration is missing: neither {places[0]} nor {places[1]} is there. Was the package copied by hand? "
        "Install it with pip instead."
    )


def _tell_effects() -> None:
    """Make each effect of the library a choice of the group `effect`."""
    for name, node in nodes().items():
        ConfigStore.instance().store(group="effect", name=name, node=node, provider="twbal")
