"""The families of hidden robots."""

from typing import NamedTuple


class Family(NamedTuple):
    """Robots of one data sheet that hide about as much.

    Attributes:
        sheet: of conf/robot.
        faults: of conf/groups/faults.yaml.
        first_seed: of the robots in the tables of the docs.
        robots: how many of them are learned there.
    """

    sheet: str
    faults: str
    first_seed: int
    robots: int


FAMILIES = {
    "hard": Family("paper", "hard", 781, 20),
    "moderate": Family("paper", "moderate", 900, 20),
    "regbot": Family("regbot", "moderate", 940, 10),
    "balboa": Family("balboa", "moderate", 940, 10),
    "esp32": Family("esp32", "moderate", 940, 10),
}
