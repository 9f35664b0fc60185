import runpy
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]


def test_the_page_of_effects_says_what_the_effects_say():
    written = runpy.run_path(str(HOUSE / "scripts" / "effects.py"))
    assert written["PAGE"].read_text() == written["page"](), "Run `python scripts/effects.py`."
