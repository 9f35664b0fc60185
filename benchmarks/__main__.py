"""The benchmarks behind README's and docs' tables, one after another: `python -m benchmarks`, or `make bench`.

Each is a module of its own too. What lies in benchmarks/results already is not timed again on the same machine; the
hidden robots go on in outputs/bench where they were. Hidden effects are apart: `make bench-hidden`.
"""

import subprocess
import sys

COMMANDS = (
    ("benchmarks.running",),
    ("benchmarks.moment_matching",),
    ("benchmarks.fitting",),
    ("benchmarks.hidden_robots",),
    ("benchmarks.hidden_robots", "recipe=paper", "updates=3", "first_seed=5000"),
)

if __name__ == "__main__":
    for module, *words in COMMANDS:
        print(f"== {' '.join([module, *words])}", flush=True)
        subprocess.run([sys.executable, "-m", module, *words], check=True)
