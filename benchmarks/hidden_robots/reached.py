"""The reference search alone, on the robots of a family: what is reachable at all.

    python -m benchmarks.hidden_robots.reached family=hard [robots=20] [first_seed=100]

Writes benchmarks/results/reference_<family>.json after each robot, and leaves robots out that are in it already.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.hidden_robots.reference import Reached, search
from benchmarks.hidden_robots.robots import FAMILIES, Workshop

RESULTS = Path("benchmarks/results")


class References:
    """What the reference search came to, robot by robot, kept in a file.

    Args:
        family: name of the robots' family.
        folder: of the file.
    """

    def __init__(self, family: str, folder: Path = RESULTS) -> None:
        self._file = folder / f"reference_{family}.json"
        self._known: dict[str, Any] = json.loads(self._file.read_text()) if self._file.exists() else {}
        self._family, self._workshop = family, Workshop(FAMILIES[family])

    def of(self, seed: int) -> Reached:
        """That of the robot `seed`, searched where it is not known."""
        known = self._known.setdefault("robots", {})
        if str(seed) not in known:
            with self._workshop.robot(seed) as robot:
                known[str(seed)] = asdict(search(robot, self._workshop.rules))
            self._known["robots"] = dict(sorted(known.items(), key=lambda item: int(item[0])))
            self._file.parent.mkdir(parents=True, exist_ok=True)
            self._file.write_text(json.dumps({"family": self._family, **self._known}, indent=1) + "\n")
        return Reached(**self._known["robots"][str(seed)])


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = {"robots": "20", "first_seed": "100", **dict(word.split("=", 1) for word in words)}
    unknown = sorted(set(settings) - {"family", "robots", "first_seed"})
    if unknown:
        raise SystemExit(f"unknown settings: {', '.join(unknown)}\n{__doc__}")
    if settings.get("family") not in FAMILIES:
        raise SystemExit(__doc__)
    references, first = References(settings["family"]), int(settings["first_seed"])
    for seed in range(first, first + int(settings["robots"])):
        found = references.of(seed)
        print(f"{settings['family']} {seed}: {found}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
