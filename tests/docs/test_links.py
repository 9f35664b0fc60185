"""Every link and picture of README and docs leads somewhere."""

import re
import runpy
import subprocess

import pytest
from shown import PAGES, ROOT

_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
_PATH = re.compile(r"`((?:twbal|tests|conf|scripts|benchmarks|docs|firmware|data)/[\w./-]*)`")
TO_BE_WRITTEN = {
    *("twbal/effects/eddy_brake.py", "tests/effects/test_eddy_brake.py"),
    *("twbal/core/separate_cost.py", "tests/core/test_separate_cost.py"),
}  # by a reader of CONTRIBUTING.md
BUILT = ("firmware/build/",)
_CODE = re.compile(r"^```.*?^```$|`[^`\n]+`", re.MULTILINE | re.DOTALL)


def links(page):
    """Targets of the links and pictures of a page, but for those of the web."""
    found = _LINK.findall(_CODE.sub("", page.read_text()))
    return [target for target in found if "://" not in target]


def anchors(page):
    """What `#...` may be on a page: its headings as GitHub spells them."""
    headings = re.findall(r"^#+ +(.+?) *$", re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.M | re.S), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.fixture(scope="module")
def tracked():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a checkout")
    return {ROOT / name for name in listed.stdout.split("\0")}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_leads_to_a_tracked_file_and_a_heading_of_it(page, tracked):
    for target in links(page):
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        assert file in tracked, f"{page.name}: ({target}) leads to no tracked file"
        if anchor:
            assert anchor in anchors(file), (
                f"{page.name}: ({target}): {file.name} has {', '.join(sorted(anchors(file)))}"
            )


def test_every_path_that_a_page_names_is_tracked(tracked):
    there = {path.relative_to(ROOT).as_posix() for file in tracked for path in (file, *file.parents) if path > ROOT}
    named = {(page.name, path.rstrip("/")) for page in PAGES for path in _PATH.findall(page.read_text())}
    assert len(named) >= 100
    missing = {(page, path) for page, path in named if path not in there | TO_BE_WRITTEN and not path.startswith(BUILT)}
    assert missing == set()


def test_every_picture_is_shown():
    shown = {(page.parent / target).resolve() for page in PAGES for target in links(page)}
    pictures = (path for path in (ROOT / "docs" / "pictures").rglob("*") if path.is_file())
    assert {path for path in pictures if path not in shown} == set()


def test_the_tables_are_what_the_results_say():
    script = runpy.run_path(str(ROOT / "scripts/readme.py"))
    for page in script["PAGES"]:
        assert script["filled"](page.read_text()) == page.read_text(), "Run `python scripts/readme.py tables`."
