import re
import runpy

import pytest
from shown import PAGES, ROOT

SETTINGS = ROOT / "docs" / "settings.md"
KEYS = re.findall(r"^\| `([^`]+)` \|", SETTINGS.read_text(), re.MULTILINE)
_KEY = re.compile(r"`\+{0,2}([a-z_]+(?:\.[a-z_*]+)+)(?:=[^`\n]*)?`")
OF_CODE = ("notation.md",)  # the pages that name modules
FILES = (".h", ".json", ".md", ".pt", ".py", ".sh", ".yaml")


def test_the_page_is_what_the_table_of_settings_says():
    written = runpy.run_path(str(ROOT / "scripts" / "settings.py"))["page"]()
    assert written == SETTINGS.read_text(), "Run `python scripts/settings.py`."


def is_known(name):
    """Whether a key is that of a setting, or the beginning of some; `*` in either stands for any name."""
    parts = name.split(".")
    if name.startswith(("sim.effects.", "sim.draws.", "ensemble.")):
        return True  # parameters of effects, which have a page of their own
    return any(
        len(parts) <= len(known) and all("*" in (a, b) or a == b for a, b in zip(parts, known, strict=False))
        for known in (key.split(".") for key in KEYS)
    )


@pytest.mark.parametrize("page", [page for page in PAGES if page.name not in OF_CODE], ids=lambda page: page.name)
def test_each_key_that_a_page_names_is_a_setting(page):
    groups = {key.split(".")[0] for key in KEYS if "." in key}
    named = {name for name in _KEY.findall(page.read_text()) if not name.endswith(FILES)}
    assert {name for name in named if name.split(".")[0] in groups and not is_known(name)} == set()


def test_a_key_that_is_no_setting_is_seen():
    assert is_known("link.timeout") and is_known("diagnosis.thresholds.*") and is_known("import.quantities.tilt.scale")
    assert not is_known("link.time_out") and not is_known("course.segments.turn")
