"""docs/notation.md names things that are there."""

import re
from dataclasses import fields, is_dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "notation.md"
PATH = re.compile(r"`([a-z_]+(?:\.\w+)+)`")


def named_paths() -> list[str]:
    return sorted(
        {path for path in PATH.findall(PAGE.read_text(encoding="utf-8")) if not path.endswith((".py", ".md"))}
    )


def has(owner: object, name: str) -> bool:
    if is_dataclass(owner) and name in [field.name for field in fields(owner)]:
        return True
    return hasattr(owner, name)


@pytest.mark.parametrize("path", named_paths())
def test_every_name_on_the_page_is_in_the_code(path: str) -> None:
    parts = ["twbal", *path.split(".")]
    depth = max(k for k in range(1, len(parts) + 1) if k == 1 or _is_module(parts[:k]))
    owner: object = import_module(".".join(parts[:depth]))
    for name in parts[depth:]:
        assert has(owner, name), f"{path}: {owner!r} has no {name}"
        owner = getattr(owner, name, None)


def _is_module(parts: list[str]) -> bool:
    try:
        return find_spec(".".join(parts)) is not None
    except ModuleNotFoundError:
        return False


def test_the_page_covers_every_equation_of_the_paper() -> None:
    page = PAGE.read_text(encoding="utf-8")
    numbers = {int(n) for n in re.findall(r"\b(\d{1,2})\b", " ".join(re.findall(r"(?:eq\. |\\tag\{)([\d, -]+)", page)))}
    spans = [(int(a), int(b)) for a, b in re.findall(r"(\d+)-(\d+)", page)]
    covered = numbers | {n for a, b in spans for n in range(a, b + 1) if b <= 17}
    assert covered >= set(range(1, 18))
