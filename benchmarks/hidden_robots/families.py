"""The families of hidden robots."""

from typing import NamedTuple


class Family(NamedTuple):
    """Robots of one data sheet that hide about as much.

    Attributes:
        sheet: of conf/robot.
        faults: of conf/groups/faults.yaml.
    """

    sheet: str
    faults: str


FAMILIES = {
    "hard": Family("paper", "hard"),
    "moderate": Family("paper", "moderate"),
    "regbot": Family("regbot", "moderate"),
    "balboa": Family("balboa", "moderate"),
    "esp32": Family("esp32", "moderate"),
}
