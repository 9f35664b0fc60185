import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_of_robots_says_what_the_sheets_say():
    written = runpy.run_path(str(ROOT / "scripts" / "robots.py"))
    assert written["PAGE"].read_text() == written["page"](), "Run `python scripts/robots.py`."
