"""Write what pages say of effects: `python scripts/effects.py`.

docs/effects.md is made of what the effects say of themselves. Other pages say how many of them a diagnosis weighs.
"""

import re
from pathlib import Path

from twbal.effects.effects_page import page
from twbal.effects.library import all_effects, library

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "effects.md"
COUNTS = {
    "README.md": r"out of \[(\d+)\]\(docs/effects\.md\)",
    "docs/concepts.md": r"It knows (\d+) physical effects",
    "docs/diagnose.md": r"the (\d+) \*effects\* of \[effects\.md\]",
}
"""The words about the number of effects by the page, with blanks for ends of lines."""


def with_count(name: str, text: str, count: int) -> str:
    """The text of a page with another number of effects.

    Args:
        name: of the page, of `COUNTS`.
        text: of it.
        count: number of effects.

    Raises:
        SystemExit: the page does not say it exactly once.
    """
    found = list(re.finditer(COUNTS[name].replace(" ", r"\s+"), text))
    if len(found) != 1:
        raise SystemExit(
            f"{name} says the number of effects {len(found)} times; expected is once, as {COUNTS[name]!r}. Was the "
            "sentence changed? Then change it in COUNTS of scripts/effects.py, too."
        )
    first, last = found[0].span(1)
    return f"{text[:first]}{count}{text[last:]}"


if __name__ == "__main__":
    PAGE.write_text(page())
    print(
        f"Wrote docs/{PAGE.name} with {len(all_effects())} effects, and that a diagnosis knows {len(library())} into:"
    )
    for name in COUNTS:
        text = (ROOT / name).read_text()
        (ROOT / name).write_text(with_count(name, text, len(library())))
        print(f"  {name}")
