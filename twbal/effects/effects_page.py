"""The page that describes effects, from what they say of themselves."""

import inspect
import textwrap
from collections.abc import Iterable, Iterator

from twbal.effects.effect import Effect
from twbal.effects.library import all_effects, effect_name, is_planar
from twbal.effects.parameter import Parameter, Scale, parameters_of

HEAD = """# Effects

An effect is something true of a robot that its nominal parameters leave out. Each is one file of `twbal/effects/` and a
choice of the group `effect`. To put one into the simulation, with a value of your own:

```
twbal sim-collect +effect@sim.effects.dead_zone=dead_zone sim.effects.dead_zone.width=0.5
```

The name after `sim.effects.` is free: `+effect@sim.effects.stiction=dead_zone` has the parameters
`sim.effects.stiction.width` and so on. No simulation has an effect twice.

`twbal diagnose` searches for all but four of them. It always estimates the noise of the sensors. Lost commands, unequal
motors and a walking bias of the gyro are found in separate steps. One effect is searched for only where
`diagnosis.include` names it.

In the tables, *range* is that of plausible robots; where a star stands beside it, it is for robots of 20 N·m, 20 ms and
12 kg, and grows with the robot's torque limit, control period or mass. *Default* is the value of an effect that is put
into a simulation on the command line, and *no effect* the values at which the whole effect does nothing. A setting may
lie up to ten times beyond the range, as far as the effect takes such values. In a loop that is faster than 20 ms,
`twbal diagnose` searches delays and lags up to the times at 20 ms.

[CONTRIBUTING.md](../CONTRIBUTING.md) says how to add an effect of your own. `python scripts/effects.py` writes this
page from the definitions.
"""


_WIDTH = 120


def page() -> str:
    """All effects, those of twbal in the order of their names."""
    return "\n".join([HEAD, *(section(kind) for kind in all_effects().values())])


def section(kind: type[Effect]) -> str:
    """One effect."""
    rows = "\n".join(_row(name, parameter) for name, parameter in parameters_of(kind).items())
    table = f"| parameter | meaning | unit | range | default | no effect |\n|---|---|---|---|---|---|\n{rows}"
    said = [textwrap.fill(text, _WIDTH, break_on_hyphens=False) for text in _comparison(kind)]
    return "\n\n".join([f"## {effect_name(kind)}", inspect.getdoc(kind) or "", table, *said]) + "\n"


def _comparison(kind: type[Effect]) -> Iterator[str]:
    """What to tell it from, and where to read on."""
    others = [name for name in kind.nearly_same_as if name not in kind.same_as]
    if kind.same_as:
        yield f"Indistinguishable from {_listed(kind.same_as)}."
    if others:
        yield f"Nearly indistinguishable from {_listed(others)}."
    if kind.weighed_if_asked:
        yield f"A diagnosis searches for it where `diagnosis.include=[{effect_name(kind)}]` asks for it."
    if is_planar(kind) or kind.diagnosed_separately:
        yield f"How to tell: {kind.separate_by}"
    yield f"Reference: {kind.reference}"


def _row(name: str, p: Parameter) -> str:
    star = "" if p.scale is Scale.NOTHING else " *"
    neutral = "unlimited" if p.neutral > p.high else f"{p.neutral:g}"
    return f"| `{name}` | {p.meaning} | {p.unit or '-'} | {p.low:g} to {p.high:g}{star} | {p.value:g} | {neutral} |"


def _listed(names: Iterable[str]) -> str:
    return " and ".join(f"[{name}](#{name})" for name in names)
