"""Run the benchmark: `python -m benchmarks.moment_matching [peer=false]`.

Every case runs in a process of its own, on one core, one after another. Raw results go to
benchmarks/results/moment_matching.json after each case; cases that are there already, on the same machine and of the
same settings, are not run again (delete the file to measure anew).
"""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator, Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

RESULTS = Path("benchmarks/results/moment_matching.json")
SIZES = (100, 300, 1000)
MOST = 10_000


def cases() -> Iterator[tuple[str, dict[str, Any]]]:
    """Which module runs what, the cheap ones first."""
    for policy in ("found", "random"):
        for keep in (False, True):
            for n in SIZES:
                settings = {"n": n, "policy": policy, "keep_variance": keep, "difference": 0}
                yield "case", {**settings, "repeats": 7 if n < 1000 else 3, "exact": n < 1000}
        yield "case", difference(policy)
    yield "case", {"n": MOST, "policy": "found", "keep_variance": False, "difference": 0, "repeats": 3, "exact": False}


def difference(policy: str) -> dict[str, Any]:
    """f + g of 1000 + 300 samples, g's variance kept."""
    return {"n": 1000, "policy": policy, "keep_variance": False, "difference": 300, "repeats": 3, "exact": False}


def peers() -> Iterator[tuple[str, dict[str, Any]]]:
    """The peer at the sizes that fit into memory; its time does not depend on how wide the states spread."""
    for n, horizon, repeats in ((100, 100, 3), (300, 25, 1)):
        yield "peer", {"n": n, "policy": "random", "horizon": horizon, "repeats": repeats}


def measured(module: str, settings: dict[str, Any]) -> dict[str, Any]:
    """The result of one case, from a process of its own."""
    command = [sys.executable, "-W", "ignore", "-m", f"benchmarks.moment_matching.{module}", json.dumps(settings)]
    one_core = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
    done = subprocess.run(command, env={**os.environ, **one_core}, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{module} {settings} failed:\n{done.stderr}")
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result


def main(words: Sequence[str]) -> None:
    """Run what is not there yet."""
    asked = [*cases(), *(peers() if "peer=false" not in words else ())]
    known: dict[str, Any] = json.loads(RESULTS.read_text()) if RESULTS.exists() else {"cases": []}
    here = {"machine": machine(), "date": str(date.today()), "twbal": version("twbal"), "torchrl": version("torchrl")}
    found = known["cases"] if known.get("machine") == here["machine"] else []
    for module, settings in asked:
        if any(each["module"] == module and each["settings"] == settings for each in found):
            continue
        result = measured(module, settings)
        found.append({"module": module, "settings": settings, "result": result, "load": round(os.getloadavg()[0], 1)})
        RESULTS.write_text(json.dumps({**here, "cases": found}, indent=1) + "\n")
        print(module, settings, f"{result['cpu_s']:.4f} s", flush=True)


def machine() -> str:
    """Processor and operating system."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor())
    return f"{model}, {platform.system()}, Python {platform.python_version()}"


if __name__ == "__main__":
    main(sys.argv[1:])
