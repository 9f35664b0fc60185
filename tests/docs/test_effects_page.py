import runpy
from pathlib import Path

import pytest

from twbal.effects.effects_page import page
from twbal.effects.library import library

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = runpy.run_path(str(ROOT / "scripts" / "effects.py"))
TOLD = "Run `python scripts/effects.py`."


def test_the_page_of_effects_says_what_the_effects_say():
    assert (ROOT / "docs" / "effects.md").read_text() == page(), TOLD


@pytest.mark.parametrize("name", SCRIPT["COUNTS"])
def test_pages_say_how_many_effects_a_diagnosis_weighs(name):
    text = (ROOT / name).read_text()
    assert SCRIPT["with_count"](name, text, len(library())) == text, TOLD


@pytest.mark.parametrize("name", SCRIPT["COUNTS"])
def test_the_script_changes_the_number_and_nothing_else(name):
    """Also where a line ends within the sentence."""
    text = (ROOT / name).read_text()
    more = SCRIPT["with_count"](name, text, 1234)
    assert more != text and SCRIPT["with_count"](name, more, len(library())) == text


def test_a_page_that_no_longer_says_it_is_named():
    with pytest.raises(SystemExit, match=r"docs/concepts.md says the number of effects 0 times; expected is once"):
        SCRIPT["with_count"]("docs/concepts.md", "It weighs many effects.", 3)
