import re
from pathlib import Path

import pytest

from twbal.effects.effects_page import page
from twbal.effects.library import library

ROOT = Path(__file__).resolve().parents[2]
COUNTS = {
    "README.md": r"out of \[(\d+)\]\(docs/effects\.md\)",
    "docs/concepts.md": r"It weighs (\d+) physical effects",
    "docs/diagnose.md": r"the (\d+) \*effects\* of \[effects\.md\]",
}


def test_the_page_of_effects_says_what_the_effects_say():
    assert (ROOT / "docs" / "effects.md").read_text() == page(), "Run `python scripts/effects.py`."


@pytest.mark.parametrize("name", COUNTS)
def test_pages_say_how_many_effects_a_diagnosis_weighs(name):
    text = " ".join((ROOT / name).read_text().split())
    assert re.findall(COUNTS[name], text) == [str(len(library()))], f"{name} says another number of effects."
