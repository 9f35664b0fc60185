"""How long `twbal --help` takes beside an empty Python: `python -m benchmarks.running.start '<settings>'`."""

import json
import resource
import subprocess
import sys
from statistics import median
from typing import Any

HEAVY = ("torch", "numpy", "hydra", "pybullet", "gpytorch", "scipy")


def seconds(*words: str) -> float:
    """CPU seconds of a Python with these arguments."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *words], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def run(repeats: int) -> dict[str, Any]:
    """Medians, and the heavy packages that the help imports."""
    call = "import sys; from twbal.cli.main import main; main(['--help'])"
    script = f"{call}; print([m for m in sys.argv[1:] if m in sys.modules])"
    said = subprocess.run([sys.executable, "-c", script, *HEAVY], check=True, capture_output=True, text=True).stdout
    return {
        "help_cpu_s": median(seconds("-m", "twbal", "--help") for _ in range(repeats)),
        "python_cpu_s": median(seconds("-c", "pass") for _ in range(repeats)),
        "heavy_imports": said.splitlines()[-1],
    }


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
