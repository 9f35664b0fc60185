import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_of_settings_says_what_the_table_says():
    written = runpy.run_path(str(ROOT / "scripts" / "settings.py"))
    assert written["PAGE"].read_text() == written["page"](), "Run `python scripts/settings.py`."
