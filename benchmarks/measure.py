"""Cases timed in processes of their own, on one core, one after another, with raw results in a file."""

import json
import os
import platform
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple, TypeVar

RESULTS = Path("benchmarks/results")
ONE_CORE = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}

Found = TypeVar("Found")


class Case(NamedTuple):
    """What runs in a process of its own.

    Attributes:
        module: with a `python -m <module> '<settings as JSON>'` that prints its result as one last line of JSON.
        settings: keyword arguments for it.
    """

    module: str
    settings: dict[str, Any]


def measure(name: str, cases: Iterable[Case]) -> None:
    """Run the cases that `benchmarks/results/<name>.json` does not have yet, and write it after each.

    Results of another machine are dropped, as times of two machines do not compare. Delete the file to measure anew.
    """
    path = RESULTS / f"{name}.json"
    known: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    here = {"machine": machine(), "date": str(date.today())}
    found = known["cases"] if known.get("machine") == here["machine"] else []
    for case in cases:
        if any(each["module"] == case.module and each["settings"] == case.settings for each in found):
            continue
        load = round(os.getloadavg()[0], 1)
        found.append({"module": case.module, "settings": case.settings, "result": measured(case), "load_before": load})
        path.write_text(json.dumps({**here, "cases": found}, indent=1) + "\n")
        print(case.module.rpartition(".")[-1], case.settings, found[-1]["result"], flush=True)


def measured(case: Case) -> dict[str, Any]:
    """The result of one case."""
    command = [sys.executable, "-W", "ignore", "-m", case.module, json.dumps(case.settings)]
    done = subprocess.run(command, env={**os.environ, **ONE_CORE}, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{case.module} {case.settings} failed:\n{done.stderr}")
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result


def timed(work: Callable[[], Found], repeats: int) -> tuple[float, Found]:
    """Median CPU seconds of `repeats` runs after one that warms up, and what came out."""
    found = work()
    seconds = []
    for _ in range(repeats):
        began = time.process_time()
        found = work()
        seconds.append(time.process_time() - began)
    return median(seconds), found


def memory_mb() -> float:
    """Most memory that this process has held [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def version_of(code: Path) -> str:
    """Commit of a folder with a clone of twbal, with a + where `twbal/` or `conf/` differs from it."""

    def git(*words: str) -> str:
        return subprocess.check_output(["git", "-C", str(code), *words], text=True).strip()

    return git("rev-parse", "--short=8", "HEAD") + ("+" if git("status", "--porcelain", "--", "twbal", "conf") else "")


def machine() -> str:
    """Processor and operating system."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor())
    return f"{model}, {platform.system()}, Python {platform.python_version()}"
