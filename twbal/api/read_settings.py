"""Which settings a function of the library reads: others would do nothing there, and are refused."""

import re
from collections.abc import Iterable, Sequence

from twbal.core.errors import ConfigError

READ_BY_SIMULATION = ("robot", "sim", "start", "state", "tilt_limit", "sim_collect.tilt_limit")
READ_BY_EVALUATION = ("robot", "sim", "start", "state", "tilt_limit", "success", "cost", "search.horizon")
_OF_MANY_PARTS = ("experiment", "method", "hydra")  # may hold any setting
_LINK = "link"


def check_read(function: str, overrides: Sequence[str], read: Iterable[str], has_plant: bool = False) -> None:
    """Check that a function reads each setting that it is given.

    Args:
        function: its name.
        overrides: that it was given, all of which there are.
        read: dotted keys of the settings, and parts of settings, that it reads.
        has_plant: whether it was given a plant.

    Raises:
        ConfigError: it does not read one.
    """
    read = tuple(read)
    for word in overrides:
        key = _key_of(word)
        if any(_overlap(key, known) for known in (*read, *_OF_MANY_PARTS)):
            continue
        advice = _about_link(word, has_plant) if key.partition(".")[0] == _LINK else ""
        raise ConfigError(f"twbal.{function} does not read {word!r:.80}; it reads {', '.join(read)}.{advice}")


def _key_of(word: str) -> str:
    """The dotted key that `part.setting=...` sets, or whose choice `group=...` or `+group@part.setting=...` is."""
    key, _, package = word.lstrip("+~").partition("=")[0].partition("@")
    return re.sub("/", ".", package or key)


def _overlap(key: str, known: str) -> bool:
    """Whether one of two dotted keys is the other, or lies within it."""
    return f"{key}.".startswith(f"{known}.") or f"{known}.".startswith(f"{key}.")


def _about_link(word: str, has_plant: bool) -> str:
    """How a link is chosen."""
    made = f"twbal.connect(port, robot, [{word!r:.80}])"
    if has_plant:
        return f" Give it to what makes the plant: {made}."
    return (
        f" To drive a robot on a link, or by port=None a virtual one, write `with {made} as plant:`, and in it "
        "twbal.evaluate(policy, robot, plant=plant)."
    )
