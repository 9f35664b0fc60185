"""Write docs/settings.md from the table of settings: `python scripts/settings.py`."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from hydra import compose
from omegaconf import OmegaConf

from twbal.cli.composition import composing
from twbal.cli.settings.help_text import shown
from twbal.cli.settings.kinds import OrNull, Part, Setting, holds_settings
from twbal.cli.settings.lookup import GROUPS, STAGES, leaves
from twbal.cli.settings.stage_settings import SECTIONS

PAGE = Path(__file__).resolve().parent.parent / "docs" / "settings.md"
HEAD = """# Settings

Each setting is given as `key=value` on the command line or stands in a yaml file of `conf/`. A value out of its range
is refused before anything runs; the ranges are wide, and only refuse what must be a slip. `twbal <stage> --help` shows
the settings of one stage, with the values that they have there.

Parameters of effects (`sim.effects.<name>.<parameter>`, `ensemble.<robot>.<name>.<parameter>`, and, as `[low, high]`,
`sim.draws.<name>.<parameter>`) are described in [effects.md](effects.md). They may lie up to ten times beyond the
ranges of that page, as far as the effect takes such values. "per torque limit" is a share of `robot.torque_limit`; sd
is a standard deviation. The defaults are those of the choices that a stage makes by itself, such as `link=virtual`.
Other choices have others: with `link=serial`, `link.timeout` is 0.5 s. This page is written by `scripts/settings.py`.
"""


def page() -> str:
    """All settings: those of each stage, then those that stages share."""
    trees = composed()
    parts = [HEAD, "## Of one stage\n"]
    for stage, rows in STAGES.items():
        sections = [name for name, owner in SECTIONS.items() if owner == stage]
        parts += [f"### twbal {stage}\n", *_elsewhere(sections), table(rows, [trees[stage]])]
    parts.append("## Of several stages\n")
    for title, rows in GROUPS.items():
        parts += [f"### {title}\n", table(rows, trees.values())]
    return "\n".join(parts)


def _elsewhere(sections: Iterable[str]) -> Iterator[str]:
    """Where other stages have the settings of a stage."""
    users = {"recordings": "regress"}
    for name in sections:
        yield f"In `twbal {users.get(name, 'iterate')}`: `{name}.<key>`.\n"


def composed() -> dict[str, dict[str, Any]]:
    """Value by key of each stage, as it is composed by default."""
    with composing():
        trees = {stage: OmegaConf.to_container(compose(stage.replace("-", "_"))) for stage in STAGES}
    return {stage: {leaf.key: leaf.value for leaf in leaves(tree)} for stage, tree in trees.items()}


def table(rows: Iterable[Setting], trees: Iterable[Mapping[str, Any]]) -> str:
    """Rows as a table; what only holds other settings, and cannot be left out by null, is not in it."""
    lines = ["| key | default | unit | range | meaning |", "|---|---|---|---|---|"]
    known = list(trees)
    for row in rows:
        values = dict.fromkeys(shown(tree[row.key]) for tree in known if row.key in tree)
        if not holds_settings(row.kind) or values or row.kind == OrNull(Part()):
            default = ", ".join(f"`{value}`" for value in values) or "-"
            lines.append(f"| `{row.key}` | {default} | {row.kind.unit or '-'} | {row.kind.range} | {row.meaning} |")
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    text = page()
    PAGE.write_text(text)
    print(f"Wrote docs/{PAGE.name} with {text.count(chr(10) + '| `')} settings.")
