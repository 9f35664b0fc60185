"""Every public name is explained: in the glossary, or in the table of settings."""

import re
from pathlib import Path

import pytest
from omegaconf import OmegaConf

import twbal
from twbal.cli.conf_folder import conf_folder
from twbal.cli.main import STAGES

PAGE = Path(__file__).resolve().parents[2] / "docs" / "glossary.md"
TEXT = PAGE.read_text()
TERMS, _, ON_THE_COMMAND_LINE = TEXT.partition("## Names on the command line")
NAMES = set(re.findall(r"`([^`]+)`", TEXT))
CONF = conf_folder()
GROUPS = CONF / "groups"
CHOICES = [f"{file.stem}/{key}".rpartition("/") for file in GROUPS.glob("*.yaml") for key in OmegaConf.load(file)]
TOGETHER = {group: {choice for other, _, choice in CHOICES if other == group} for group, _, _ in CHOICES}
FOLDERS = {file.parent.relative_to(CONF).as_posix(): set() for file in CONF.rglob("*.yaml")} | TOGETHER
OWN_PAGE = ("robot", "effect", "model/search")  # choices that are named after what they describe
NOT_CHOSEN = (".", "groups", "task", "model/search")


def terms():
    """Cells of each row of the tables of terms."""
    for line in TERMS.splitlines():
        if line.startswith("|") and not line.startswith(("| term", "|---")):
            yield [cell.strip() for cell in line.strip("|").split("|")]


@pytest.mark.parametrize("stage", STAGES)
def test_every_stage_is_in_the_glossary(stage):
    assert stage in NAMES


@pytest.mark.parametrize("group", sorted(set(FOLDERS) - set(NOT_CHOSEN)))
def test_every_group_is_in_the_glossary_with_its_choices(group):
    rows = [line for line in ON_THE_COMMAND_LINE.splitlines() if line.startswith("|")]
    (row,) = (line for line in rows if f"`{group}`" in line.split("|")[1])
    if group not in OWN_PAGE:
        files = {file.stem for file in (CONF / group).glob("*.yaml")}
        assert FOLDERS[group] | files <= set(re.findall(r"`([^`]+)`", row))


@pytest.mark.parametrize("name", [name for name in twbal.__all__ if not name.startswith("_")])
def test_every_name_of_the_library_is_in_the_glossary(name):
    assert name in NAMES


def test_every_term_has_one_sentence_and_a_reference():
    found = list(terms())
    assert len(found) >= 60
    for term, meaning, reference in found:
        assert term and reference
        assert meaning.endswith(".") and meaning.count(". ") == 0, term


def test_no_term_is_explained_twice():
    names = [term for term, _, _ in terms()]
    assert len(names) == len(set(names))
