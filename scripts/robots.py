"""Write docs/robots.md from the sheets of conf/robot/: `python scripts/robots.py`."""

import re
import textwrap
from pathlib import Path

import yaml

from twbal.cli.settings.robot_settings import ROBOT
from twbal.core.robot_sheet import MEANING, TOLERANCE_FACTORS, VALUES, provenance_of

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "robots.md"
HEAD = """# Robots

`robot=<name>` chooses the robot of any command. A sheet is one file of `conf/robot/`;
[CONTRIBUTING.md](../CONTRIBUTING.md#a-new-robot-step-by-step) says how to add one, and
[your robot](your_robot.md#1-write-down-the-parameters) how to keep one in a folder of yours. Its `provenance` says of
each value where it comes from:

{meanings}

`twbal diagnose` lets each value move within a tolerance that follows from this: a published value has
`diagnosis.tolerances.data_sheet`, others have so many times as much, and none has more than
`diagnosis.tolerances.rough`. The tolerance of `torque_limit` serves for the motors' gain.

A sheet is refused where no body has its inertias: where one is more than the other two together, or where a body that
is as high and as wide as this one cannot have it. This page is written by `scripts/robots.py`.
"""


def page() -> str:
    """All sheets, in the order of their names."""
    meanings = [f"- `{kind}`: {meaning}. Tolerance x {TOLERANCE_FACTORS[kind]:g}." for kind, meaning in MEANING.items()]
    sheets = sorted((ROOT / "conf" / "robot").glob("*.yaml"))
    return "\n".join([HEAD.format(meanings="\n".join(meanings)), *(section(sheet) for sheet in sheets)])


def section(sheet: Path) -> str:
    """One robot: what its file says of it, and its values."""
    text = sheet.read_text()
    values = yaml.safe_load(text)
    kinds = provenance_of(values["name"], values["provenance"])
    said = " ".join(line.removeprefix("#").strip() for line in text.partition("_target_")[0].splitlines())
    units = {row.key.removeprefix("robot."): row.kind.unit for row in ROBOT}
    lines = [
        f"## {values['name']}",
        "",
        *textwrap.wrap(said, 118, break_on_hyphens=False),
        "",
        "| value | | unit | provenance | source |",
    ]
    lines.append("|---|---|---|---|---|")
    for name in VALUES:
        lines.append(f"| {name} | {values[name]:g} | {units[name]} | {kinds[name]} | {source(text, name)} |")
    return "\n".join([*lines, ""])


def source(text: str, name: str) -> str:
    """What the comment beside a value says behind its unit, on that line and on lines of comment right below."""
    comment = re.search(rf"^{name}:[^#\n]*#(.*(?:\n *#.*)*)", text, flags=re.MULTILINE)
    remark = re.sub(r"\s*\n *#\s*", " ", comment[1]).partition(";")[2].strip() if comment else ""
    return remark.replace("|", "\\|").replace("*", "\\*") or "-"


if __name__ == "__main__":
    PAGE.write_text(page())
