"""Write docs/effects.md from what the effects say of themselves: `python scripts/effects.py`."""

from pathlib import Path

from twbal.effects.effects_page import page

PAGE = Path(__file__).resolve().parent.parent / "docs" / "effects.md"

if __name__ == "__main__":
    PAGE.write_text(page())
