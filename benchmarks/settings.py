"""Settings of a benchmark, as key=value."""

from collections.abc import Mapping, Sequence


def text_settings(defaults: Mapping[str, str], words: Sequence[str], usage: str = "") -> dict[str, str]:
    """The settings, each a text, with their names checked.

    Args:
        usage: What the settings are, in place of their names and defaults.

    Raises:
        SystemExit: one is unknown.
    """
    given = dict(word.partition("=")[::2] for word in words)
    if unknown := sorted(set(given) - set(defaults)):
        raise SystemExit(f"unknown settings: {', '.join(unknown)}. {usage or f'Settings are: {_listed(defaults)}.'}")
    return {**defaults, **given}


def number_settings(defaults: Mapping[str, int], words: Sequence[str]) -> dict[str, int]:
    """The settings, checked.

    Raises:
        SystemExit: one is unknown, or no positive number.
    """
    given = text_settings({name: str(value) for name, value in defaults.items()}, words)
    if wrong := [name for name, value in given.items() if not value.isdecimal() or not int(value)]:
        raise SystemExit(f"{', '.join(wrong)} must be a positive number; settings are: {_listed(defaults)}.")
    return {name: int(value) for name, value in given.items()}


def _listed(defaults: Mapping[str, object]) -> str:
    return ", ".join(f"{name}={value}" for name, value in defaults.items()) or "none"
