"""Settings of a benchmark, as key=value."""

import json
from collections.abc import Hashable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any


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


def refuse_to_replace(results: Path, there: Iterable[Hashable], asked: Iterable[Hashable]) -> None:
    """Keep a file of results that holds more than what is asked for.

    Args:
        results: the file; it need not exist.
        there: keys of the results in it, such as seeds.
        asked: keys of the results that will replace it.

    Raises:
        SystemExit: it holds others.
    """
    if others := sorted(map(str, set(there) - set(asked))):
        some = ", ".join(others[:5]) + (", ..." if len(others) > 5 else "")
        raise SystemExit(f"{results} holds results that are not asked for ({some}): choose another file by results=.")


def rows_in(results: Path, key: str = "sets") -> list[dict[str, Any]]:
    """Rows of a file of results; none where there is no file."""
    found: list[dict[str, Any]] = json.loads(results.read_text()).get(key, []) if results.exists() else []
    return found


def _listed(defaults: Mapping[str, object]) -> str:
    return ", ".join(f"{name}={value}" for name, value in defaults.items()) or "none"
