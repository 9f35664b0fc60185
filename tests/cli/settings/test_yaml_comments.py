"""Who edits a yaml file reads the unit beside each value, and it is that of the table."""

import re
from pathlib import Path

import pytest
import yaml

from twbal.cli.conf_folder import conf_folder
from twbal.cli.settings.lookup import STAGES, Table
from twbal.effects.library import nodes

CONF = conf_folder()
FILES = sorted(path.relative_to(CONF) for path in CONF.rglob("*.yaml") if path.stem != "base")
UNITS = (
    *(
        "rad",
        "rad/s",
        "rad/s/√s",
        "m",
        "m/s",
        "m/s²",
        "s",
        "kg",
        "kg·m²",
        "N",
        "N/m",
        "N·m",
        "N·m·s/rad",
        "N·m/A",
        "Hz",
        "1/s",
    ),
    *("1/m", "ohm", "V", "bit/s", "pixels"),
)


def scalars(node, prefix=""):
    """Key and line of each value."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield from scalars(value, f"{prefix}{key.value}.")
    elif node is not None:
        yield prefix.rstrip("."), node.start_mark.line


def parts():
    """Each configuration that a file has: the file, what it is of, and its node."""
    for file in FILES:
        node = yaml.compose((CONF / file).read_text())
        if file.parts[0] != "groups":
            yield file, "" if file.parent == Path() else file.parent.as_posix(), node
            continue
        is_global = (CONF / file).read_text().startswith("# @package _global_")
        for choice, inner in node.value:
            own = f"{file.stem}/{choice.value}".rpartition("/")[0]
            group = choice.value if own == "task" else own
            yield file, "_global_" if is_global else group, inner


def table_and_prefix(file, group, node):
    """The table for a configuration, and where its values lie in that of a stage."""
    if group in ("", "_global_"):
        return Table(file.stem.replace("_", "-") if group == "" else "iterate", {}), ""
    tree = yaml.safe_load(yaml.serialize(node))
    whole = {group: tree} if group in ("sim", "ensemble") else {}
    for effects in (whole.get("ensemble") or {}).values():
        for name, effect in (effects if isinstance(effects, dict) else {}).items():
            effect["_target_"] = nodes()[name]["_target_"]
    place = {"model/search": "model.fit_f.settings"}.get(group, group.replace("/", "."))
    return Table("iterate", whole), f"{place}."


PARTS = list(parts())


@pytest.mark.parametrize(("file", "group", "node"), PARTS, ids=[f"{file}-{group}" for file, group, _ in PARTS])
def test_the_unit_beside_a_value_is_that_of_the_table(file, group, node):
    table, prefix = table_and_prefix(file, group, node)
    lines = (CONF / file).read_text().splitlines()
    found = [(key, line) for key, line in scalars(node) if not key.startswith(("hydra", "defaults"))]
    for key, line in found:
        row = table.row(f"{prefix}{key}")
        if row is None or sum(other == line for _, other in found) > 1:  # such as {tilt: 0.5, speed: 0.5}
            continue
        comment = re.search(r"#\s*(.*)", lines[line])
        said = next((u for u in UNITS if comment and re.match(rf"{re.escape(u)}(?![\w·/²])", comment[1])), "")
        expected = row.kind.unit if row.kind.unit in UNITS else ""
        assert said == expected, f"{file}: {lines[line]}"


def test_every_stage_has_a_table():
    assert {path.stem.replace("_", "-") for path in CONF.glob("*.yaml")} - {"base"} == set(STAGES)
