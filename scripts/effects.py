"""Write docs/effects.md from what the effects say of themselves: `python scripts/effects.py`."""

import inspect
import re
from pathlib import Path

from twbal.effects.effect import Effect, Parameter, parameters_of
from twbal.effects.library import library

PAGE = Path(__file__).resolve().parent.parent / "docs" / "effects.md"
HEAD = """# Effects

What a robot may have that its data sheet leaves out. Each is a file of `twbal/effects/` and a choice of
`conf/effect/`. To put one into the simulation:

```
twbal sim-collect +effect@sim.effects.dead_zone=dead_zone sim.effects.dead_zone.width=0.5
```

`twbal diagnose` weighs all of them. Ranges are those of plausible robots; torques are for the 20 N·m class and shrink
with the robot's torque limit, times are for a control period of 20 ms and grow with it. This page is written by
`scripts/effects.py`.
"""


def page() -> str:
    """All effects, in the order of their names."""
    return "\n".join([HEAD, *(section(name, kind) for name, kind in library().items())])


def section(name: str, kind: type[Effect]) -> str:
    """One effect."""
    first, *rest = re.split(r"\n\s*\n", inspect.getdoc(kind) or "")
    said = [first, *(part for part in rest if not part.startswith(("Attributes:", "Raises:", "Args:")))]
    lines = [f"## {name}", "", *[f"{' '.join(part.split())}\n" for part in said]]
    lines += ["| parameter | unit | range | no effect at |", "|---|---|---|---|"]
    lines += [row(key, parameter) for key, parameter in parameters_of(kind).items()]
    if kind.cannot_be_told_from:
        lines += ["", f"Hardly told from {', '.join(kind.cannot_be_told_from)}. {kind.separate_by}"]
    return "\n".join([*lines, ""])


def row(name: str, parameter: Parameter) -> str:
    """One parameter."""
    return f"| {name} | {parameter.unit or '-'} | {parameter.low:g} to {parameter.high:g} | {parameter.none:g} |"


if __name__ == "__main__":
    PAGE.write_text(page())
