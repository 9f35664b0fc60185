"""Import checks on logs of drawn robots: `python -m benchmarks.import_checks [first=1000] [robots=30] [each=10]`.

The logs of the first robots as they are, and with stamps in bunches or without a tilt; for each kind of fault logs that
can have it, until there are enough; and logs that a second call imports again. Takes two processes some ten minutes.
The result is `benchmarks/results/import_checks.json`; `python scripts/readme.py tables` makes tables of it.
"""

import json
import shlex
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from datetime import date
from itertools import count
from pathlib import Path
from typing import Any

from benchmarks.import_checks.again import NAMES, imported_again
from benchmarks.import_checks.case import convention, correct, planted
from benchmarks.import_checks.faults import FAULTS
from benchmarks.import_checks.other_sensors import CONVENTIONS
from benchmarks.settings import text_settings

RESULTS = Path("benchmarks/results/import_checks.json")


_PROCESSES = 2
DEFAULTS = {"first": "1000", "robots": "30", "each": "10"}
"""First seed, robots whose logs are imported as they are, and faults of each kind."""


def main(words: Sequence[str]) -> None:
    """Run all with settings of the form key=value, and write the result."""
    usage = f"Settings are {', '.join(DEFAULTS)}, whole numbers; found {shlex.join(words)}."
    settings = text_settings(DEFAULTS, words, usage)
    if not all(value.isdecimal() for value in settings.values()):
        raise SystemExit(usage)
    first, robots, each = (int(settings[name]) for name in DEFAULTS)
    with ProcessPoolExecutor(_PROCESSES) as pool:
        logs = pool.map(correct, range(first, first + robots))
        lacking = [(seed, name) for name in CONVENTIONS for seed in range(first, first + robots)]
        conventions = pool.map(convention, *zip(*lacking, strict=True))
        faults = [pool.submit(_planted, name, first, each) for name in FAULTS]
        asked = [(seed, what) for what in NAMES for seed in range(first, first + each)]
        again = pool.map(imported_again, *zip(*asked, strict=True))
        results = {
            "date": str(date.today()),
            "first": first,
            "logs": list(logs),
            "conventions": [case for case in conventions if case is not None],
            "faults": [case for found in faults for case in found.result()],
            "again": list(again),
        }
    RESULTS.write_text(json.dumps(results, indent=1) + "\n")


def _planted(name: str, first: int, each: int) -> list[dict[str, Any]]:
    """The first cases of a fault."""
    found: list[dict[str, Any]] = []
    for seed in count(first):
        case = planted(seed, name)
        found += [case] if case is not None else []
        if len(found) == each:
            break
    print(name, sum(case["named"] for case in found), sum(case["found"] for case in found), flush=True)
    return found


if __name__ == "__main__":
    main(sys.argv[1:])
