"""Time in which a virtual machine's processors were withheld from it: its host gave them to others."""

from collections.abc import Callable
from pathlib import Path

_STAT = Path("/proc/stat")
_STEAL = 7  # of the times of `cpu`, in proc_stat(5)


def withheld_share(stat: Path = _STAT) -> Callable[[], float | None]:
    """Begin to look; the result, called later, is the share of all processors' time since then [%].

    None where the system does not count it.

    Args:
        stat: as proc_stat(5) says.
    """
    before = _times(stat)

    def since() -> float | None:
        passed = [now - then for now, then in zip(_times(stat), before, strict=True)]
        return round(100.0 * passed[_STEAL] / sum(passed), 2) if len(passed) > _STEAL and sum(passed) else None

    return since


def _times(stat: Path) -> list[int]:
    """Of all processors together, those up to the time withheld: the later ones are in the others already."""
    try:
        words = stat.read_text().splitlines()[0].split()
    except (OSError, IndexError):
        return []
    return [int(word) for word in words[1 : 2 + _STEAL]]
