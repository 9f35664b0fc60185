"""Settings of a benchmark that are numbers, as key=value."""

from collections.abc import Mapping, Sequence


def number_settings(defaults: Mapping[str, int], words: Sequence[str]) -> dict[str, int]:
    """The settings, checked.

    Raises:
        SystemExit: one is unknown, or no positive number.
    """
    given = dict(word.partition("=")[::2] for word in words)
    known = ", ".join(f"{name}={value}" for name, value in defaults.items()) or "none"
    if unknown := sorted(set(given) - set(defaults)):
        raise SystemExit(f"unknown settings: {', '.join(unknown)}. Settings are: {known}.")
    if wrong := [name for name, value in given.items() if not value.isdecimal() or not int(value)]:
        raise SystemExit(f"{', '.join(wrong)} must be a positive number; settings are: {known}.")
    return {**defaults, **{name: int(value) for name, value in given.items()}}
