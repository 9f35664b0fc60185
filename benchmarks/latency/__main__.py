"""Time the commands to a robot at 50, 100 and 200 Hz, with and without real-time priority, alone and beside a load.

    python -m benchmarks.latency [seconds=600] [cases=load_real_time_100,quiet_on_board_50]

Without `cases` all 22 of `CASES` are measured, which include the line alone; without `seconds` each as long as
`SECONDS` says, in all some 32 minutes. A case that is measured on this machine for as long is not measured again. Close
all other programs before: the load is part of the cases. Raw results go to benchmarks/results/latency.json after each
case. Needs g++, make, chrt and the right to real-time priority.
"""

import shlex
import shutil
import sys
from collections.abc import Sequence

from benchmarks.latency.case import HOSTS
from benchmarks.latency.line import LINES
from benchmarks.measure import Case, measure
from benchmarks.settings import text_settings

LOADS = {"quiet": 0, "load": 8}
RATES = (50, 100, 200)
LONG = {"load_real_time_100": 600.0, "load_on_board_100": 600.0, "quiet_real_time_100": 60.0}
"""Of those that are not as long as all others [s]."""
CASES = {
    **{
        f"{load}_{host}_{rate}": Case("benchmarks.latency.case", {"load": programs, "host": host, "rate": rate})
        for load, programs in LOADS.items()
        for host in HOSTS
        for rate in RATES
    },
    **{
        f"{load}_line_{line}": Case("benchmarks.latency.line", {"load": programs, "line": line})
        for load, programs in LOADS.items()
        for line in LINES
    },
}
SECONDS = {name: LONG.get(name, 20.0) for name in CASES}
"""For which each is driven, where nothing else is asked for [s]."""


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    usage = f"Settings are seconds (a positive number) and cases (of {', '.join(CASES)}); found {shlex.join(words)}."
    settings = text_settings({"seconds": "", "cases": ",".join(CASES)}, words, usage)
    everywhere, names = settings["seconds"], settings["cases"].split(",")
    if not set(names) <= set(CASES) or not (everywhere == "" or _is_time(everywhere)):
        raise SystemExit(usage)
    missing = [tool for tool in ("g++", "make", "chrt", "setpriv") if shutil.which(tool) is None]
    if missing:
        raise SystemExit(f"This benchmark needs {', '.join(missing)}, which cannot be found on this computer.")
    seconds = {name: float(everywhere or SECONDS[name]) for name in names}
    asked = ((CASES[name], seconds[name]) for name in names)
    measure("latency", [Case(case.module, {**case.settings, "seconds": time}) for case, time in asked])


def _is_time(word: str) -> bool:
    try:
        return 0.0 < float(word) < float("inf")
    except ValueError:
        return False


if __name__ == "__main__":
    main(sys.argv[1:])
