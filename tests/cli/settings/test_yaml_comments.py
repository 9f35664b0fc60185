"""Who edits a yaml file reads the unit beside each value, and it is that of the table."""

import re

import pytest
import yaml

from twbal.cli.conf_folder import conf_folder
from twbal.cli.settings.lookup import STAGES, Table
from twbal.effects.library import nodes

CONF = conf_folder()
FILES = sorted(path.relative_to(CONF) for path in CONF.rglob("*.yaml") if path.stem != "base")
UNITS = (
    *("rad", "rad/s", "m", "m/s", "m/s²", "s", "kg", "kg·m²", "N", "N/m", "N·m", "N·m·s/rad", "N·m/A", "Hz", "1/s"),
    *("1/m", "ohm", "V", "bit/s", "pixels"),
)


def scalars(node, prefix=""):
    """Key and line of each value."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield from scalars(value, f"{prefix}{key.value}.")
    elif node is not None:
        yield prefix.rstrip("."), node.start_mark.line


def table_and_prefix(file, text):
    """The table for a file, and where its values lie in the configuration of a stage."""
    group = file.parent.as_posix()
    if "@package _global_" in text:
        return Table("iterate", {}), ""
    if group in (".", "stage"):
        return Table(file.stem.replace("_", "-"), {}), ""
    tree = yaml.safe_load(text) or {}
    whole = {"sim": tree} if group == "sim" else {"variants": tree} if group == "variants" else {}
    for effects in (whole.get("variants") or {}).values():
        for name, effect in (effects if isinstance(effects, dict) else {}).items():
            effect["_target_"] = nodes()[name]["_target_"]
    place = {"model/search": "model.fit_f.settings"}.get(group, group.replace("/", "."))
    return Table("iterate", whole), f"{place}."


@pytest.mark.parametrize("file", FILES, ids=str)
def test_the_unit_beside_a_value_is_that_of_the_table(file):
    text = (CONF / file).read_text()
    table, prefix = table_and_prefix(file, text)
    lines = text.splitlines()
    found = [(key, line) for key, line in scalars(yaml.compose(text)) if not key.startswith(("hydra", "defaults"))]
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
