"""Collection on two processes beside one [s of wall time]: `python -m benchmarks.running.collection '<settings>'`."""

import json
import shutil
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

OUT = Path("outputs/bench/collection")


def seconds(workers: int, rollouts: int, steps: int) -> float:
    """Wall time of `twbal sim-collect` as a person sees it, from start to end."""
    shutil.rmtree(OUT, ignore_errors=True)
    words = [f"rollouts={rollouts}", f"steps={steps}", f"workers={workers}", f"hydra.run.dir={OUT}"]
    began = time.perf_counter()
    subprocess.run([sys.executable, "-m", "twbal", "sim-collect", *words], check=True, capture_output=True)
    return time.perf_counter() - began


def run(rollouts: int, steps: int, repeats: int) -> dict[str, Any]:
    """Both, turn by turn; medians."""
    spent = [(seconds(1, rollouts, steps), seconds(2, rollouts, steps)) for _ in range(repeats)]
    one, two = (median(each[i] for each in spent) for i in (0, 1))
    return {"one_s": one, "two_s": two, "times_faster": median(a / b for a, b in spent)}


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
