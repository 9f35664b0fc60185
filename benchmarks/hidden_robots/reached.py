"""The reference search alone, on the robots of a family: what is reachable at all.

    python -m benchmarks.hidden_robots.reached family=hard [robots=20] [first_seed=100] [pushes=true]

Writes benchmarks/results/reference_<family>.json after each robot, and leaves robots out that are in it already. With
pushes=true the robots are pushed, too, under the controller with the least oscillation.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.hidden_robots.families import FAMILIES
from benchmarks.hidden_robots.pushes import PushVerdict
from benchmarks.hidden_robots.reference import Reached, pushed, search
from benchmarks.hidden_robots.reference_law import Compensation, Design
from benchmarks.hidden_robots.robots import Workshop
from benchmarks.settings import text_settings
from twbal.core.files import write_atomically

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
            self._keep("robots", known)
        return Reached(**self._known["robots"][str(seed)])

    def pushes(self, seed: int) -> list[PushVerdict]:
        """What becomes of ten pushes of the robot `seed` under its best controller; none where nothing holds it."""
        known, design = self._known.setdefault("pushes", {}), self.of(seed).design
        if str(seed) not in known and design is not None:
            shop = self._workshop
            found = Design(**{**design, "friction": Compensation(**design["friction"])})
            with shop.robot(seed) as robot:
                known[str(seed)] = [each._asdict() for each in pushed(robot, found, shop.sheet, shop.rules.default)]
            self._keep("pushes", known)
        return [PushVerdict(**each) for each in known.get(str(seed), ())]

    def _keep(self, part: str, known: Mapping[str, Any]) -> None:
        self._known[part] = dict(sorted(known.items(), key=lambda item: int(item[0])))
        write_atomically(self._file, json.dumps({"family": self._family, **self._known}, indent=1) + "\n")


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = text_settings({"family": "", "robots": "20", "first_seed": "100", "pushes": "false"}, words)
    if settings["family"] not in FAMILIES:
        raise SystemExit(__doc__)
    references, first = References(settings["family"]), int(settings["first_seed"])
    for seed in range(first, first + int(settings["robots"])):
        found = references.of(seed)
        print(f"{settings['family']} {seed}: {found}", flush=True)
        if settings["pushes"] == "true":
            print(f"pushes: {sum(each.survived for each in references.pushes(seed))} survived", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
