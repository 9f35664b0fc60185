"""The benchmarks behind README's and docs' tables, one after another: `python -m benchmarks`, or `make bench`.

Each is a module of its own too. What lies in benchmarks/results already is not timed again on the same machine; the
hidden robots go on in outputs/bench where they were. Hidden effects are apart: `make bench-hidden`.
"""

import subprocess
import sys

from benchmarks.hidden_robots.families import FAMILIES

BESIDE = ("pilco", "lqr", "lqr_integral", "lqr_identified")
COMMANDS = (
    ("benchmarks.running",),
    ("benchmarks.moment_matching",),
    ("benchmarks.validation",),
    ("benchmarks.fitting",),
    *(("benchmarks.hidden_robots", f"family={family}") for family in FAMILIES),
    *(("benchmarks.hidden_robots", "family=moderate", f"recipe={recipe}") for recipe in BESIDE),
    ("benchmarks.driving",),
    ("benchmarks.robustness",),
    *(("benchmarks.link_faults", f"robot={robot}") for robot in ("virtual", "firmware")),
    ("benchmarks.on_firmware",),
)

if __name__ == "__main__":
    for module, *words in COMMANDS:
        print(f"== {' '.join([module, *words])}", flush=True)
        subprocess.run([sys.executable, "-m", module, *words], check=True)
