"""Entries of a proposed mapping beside its quantities: the motor, and how the rows were written."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from twbal.core.motor import Motor

_MOTOR_UNITS = {"resistance": "ohm", "torque_constant": "N·m/A", "gear": "", "supply": "V"}
_ROWS = {
    "command_is_sample": ("false", "true: the command is an instant of a loop that runs faster than the log"),
    "command_before_sample": ("false", "true: a row's command acted before the row's sample, not after it"),
    "skip": ("0.0", "s; left out at the beginning of each recording"),
    "fill": ("3", "missing samples in a row within a recording; a longer gap begins a new recording"),
}
"""How rows were written: value where nothing is known, and meaning."""


class KnownMapping(NamedTuple):
    """The mapping that the configuration has for logs of a robot.

    Attributes:
        name: of the choice, which is the robot's.
        entries: as yaml says them.
    """

    name: str
    entries: Mapping[str, Any]

    @property
    def motor(self) -> Mapping[str, Any]:
        """Entries of its motor; none where it has none."""
        found = self.entries.get("motor")
        return found if isinstance(found, Mapping) else {}

    def has_quantities(self, proposed: Mapping[str, Any]) -> bool:
        """Whether it takes each quantity from where a proposal does."""
        ours = self.entries.get("quantities")
        return isinstance(ours, Mapping) and _there(ours) == _there(proposed)


def _there(quantities: Mapping[str, Any]) -> Mapping[str, Any]:
    return {name: source for name, source in quantities.items() if source is not None}


class RemainingEntries(NamedTuple):
    """Lines of a mapping below its quantities, and which of them are open."""

    text: str
    open: tuple[str, ...]


def remaining_entries(
    proposed: Mapping[str, Any], needs_motor: bool, answered: str, known: KnownMapping | None
) -> RemainingEntries:
    """What stands below the quantities.

    Args:
        proposed: quantities, as yaml says them.
        needs_motor: whether the command is a voltage.
        answered: speeds by which the control loop may run faster than the log; "" where nothing says so.
        known: mapping of the robot; None where there is none.
    """
    motor = known.motor if known else {}
    lines, left = ["motor: null"], []
    if needs_motor:
        source = f"as import={known.name} has it" if known and motor else "from its data sheet"
        lines = [f"motor:  # both together, as one; {source}", f"  _target_: {Motor.__module__}.{Motor.__name__}"]
        lines += [
            f"  {name}: {motor.get(name, '???')}{f'  # {unit}' if unit else ''}" for name, unit in _MOTOR_UNITS.items()
        ]
        left += ["motor"] if any(motor.get(name, "???") == "???" for name in _MOTOR_UNITS) else []
    is_same = known is not None and known.has_quantities(proposed)
    for name, (value, meaning) in _ROWS.items():
        if known is not None and is_same and name in known.entries:
            found, source = str(known.entries[name]).lower(), f"as import={known.name} has it; {meaning}"
            lines.append(f"{name}: {found}  # {source}")
        elif name == "command_is_sample" and answered:
            why = f"the command answers {answered}, a speed that is no change of the wheels' path from row to row"
            lines.append(f"{name}: ???  # {why}: true if the control loop runs faster than the log, else false")
            left.append(f"{name} ({why}: does the control loop run faster than the log?)")
        else:
            lines.append(f"{name}: {value}  # {meaning}")
    return RemainingEntries("\n".join(lines) + "\n", tuple(left))
