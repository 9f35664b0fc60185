"""What the pages say beside the tables agrees with the records and with the history of the repository."""

import json
import re
import subprocess

import pytest
from shown import PAGES, ROOT

from benchmarks.other_robots.findings import sure_findings

RESULTS = ROOT / "benchmarks" / "results"
_TABLE = re.compile(r"<!-- table (\w+) of (\w+)")
_RIGHT = re.compile(r"Of (\d+) effects\W{0,2} [^.]*?at least 0\.9, (\d+) are right")
_IN_LIBRARY = re.compile(r"[Ww]ithout the sets that hold what the library lacks,?(?: it is)? (\d+) of (\d+)")
_HELD = re.compile(r"\*\*Intervals\*\* hold (\d+) of (\d+) true sizes")
_COMMIT = re.compile(r"\bcommits? ([0-9a-f]{7,8})(?: to ([0-9a-f]{7,8}))?\b")


def sets_of(record):
    return json.loads((RESULTS / f"{record}.json").read_text())["sets"]


def right_of_named(rows):
    """How many effects got a probability of at least 0.9, and how many of them are right."""
    named = sure_findings(rows)
    return len(named), sum(each.is_right for each in named)


def sections():
    """Text of each part of the page that has the figures of one record of other robots, with the record.

    Lines of a paragraph are joined.
    """
    for text in re.split(r"^##+ ", (ROOT / "docs" / "benchmarks_diagnosis.md").read_text(), flags=re.MULTILINE):
        records = {record for table, record in _TABLE.findall(text) if table == "other_robots_figures"}
        if records:
            (record,) = records
            yield record, " ".join(text.split())


@pytest.mark.parametrize(("record", "text"), [pytest.param(*found, id=found[0]) for found in sections()])
def test_a_section_says_the_figures_of_its_record(record, text):
    rows = sets_of(record)
    in_library = [row for row in rows if not row["foreign"]]
    held = [interval[-1] for row in rows for interval in row["intervals"]]
    said = [_RIGHT.findall(text), [pair[::-1] for pair in _IN_LIBRARY.findall(text)]]
    measured = [right_of_named(rows), right_of_named(in_library)]
    for found, (named, right) in zip(said, measured, strict=True):
        assert found in ([], [(str(named), str(right))])
    assert said[0], f"{record}: how many of the effects with a probability of at least 0.9 are right?"
    assert _HELD.findall(text) in ([], [(str(sum(held)), str(len(held)))])


def test_the_readme_says_the_figures_of_the_current_version():
    text = " ".join((ROOT / "README.md").read_text().split())
    rows = sets_of("other_robots_current")
    (found,) = re.findall(
        r"On (\d+) \[simulated robots.{0,120}?, (\d+) of the (\d+) effects.{0,60}?\((\d+) of (\d+)", text
    )
    named, right = right_of_named(rows)
    hard = [each.is_right for each in sure_findings(rows) if not each.is_easy]
    assert tuple(map(int, found)) == (len(rows), right, named, sum(hard), len(hard))


def test_each_commit_that_a_page_names_is_in_the_history():
    def git(*words):
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True)

    if git("rev-parse", "--is-shallow-repository").stdout.strip() != "false":
        pytest.skip("not a checkout with its history")
    named = {commit for page in PAGES for both in _COMMIT.findall(page.read_text()) for commit in both if commit}
    assert len(named) >= 8
    assert {commit for commit in named if git("cat-file", "-e", f"{commit}^{{commit}}").returncode} == set()
