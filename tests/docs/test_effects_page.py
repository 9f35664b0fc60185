from pathlib import Path

from twbal.effects.page import page

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_of_effects_says_what_the_effects_say():
    assert (ROOT / "docs" / "effects.md").read_text() == page(), "Run `python scripts/effects.py`."
