"""Every public function has an example that runs, as do the examples of docs/api.md."""

import doctest
import importlib
import re
from pathlib import Path

import pytest

import twbal

ROOT = Path(__file__).parents[2]
FUNCTIONS = [name for name in twbal.__all__ if name[0].islower()]
LONG = ("diagnose", "learn")


def run(example):
    runner = doctest.DocTestRunner(verbose=False)
    report: list[str] = []
    runner.run(example, out=report.append)
    assert runner.tries, f"{example.name} has no example"
    assert not runner.failures, "".join(report)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in LONG else name for name in FUNCTIONS]
)
def test_a_public_function_does_what_its_example_shows(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    function = getattr(twbal, name)
    module = importlib.import_module(function.__module__)
    (example,) = doctest.DocTestFinder(recurse=False).find(function, name, module)
    run(example)


@pytest.mark.slow
def test_the_page_does_what_it_shows(monkeypatch):
    monkeypatch.chdir(ROOT)
    page = "\n".join(re.findall(r"^```pycon\n(.*?)^```$", (ROOT / "docs" / "api.md").read_text(), re.M | re.S))
    run(doctest.DocTestParser().get_doctest(page, {}, "docs/api.md", "docs/api.md", 0))
