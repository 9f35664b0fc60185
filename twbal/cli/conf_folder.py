"""Where the configuration lies: in a checkout, an editable install and a wheel."""

from pathlib import Path

from twbal.core.errors import ConfigError


def conf_folder() -> Path:
    """The folder of the yaml files, absolute.

    A wheel carries it inside the package; a checkout (and an editable install of one) has it beside the package.

    Raises:
        ConfigError: it is in neither place.
    """
    package = Path(__file__).resolve().parents[1]
    places = (package / "conf", package.parent / "conf")
    for place in places:
        if place.is_dir():
            return place
    raise ConfigError(
        f"The configuration is missing: neither {places[0]} nor {places[1]} is there. Was the package copied by hand? "
        "Install it with pip instead."
    )
