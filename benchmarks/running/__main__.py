"""Run the benchmark: `python -m benchmarks.running`; see `benchmarks.measure`. Two free cores, a minute."""

from benchmarks.measure import Case, measure

CASES = (
    Case("benchmarks.running.plant", {"periods": 500, "repeats": 9}),
    Case("benchmarks.running.collection", {"rollouts": 2000, "steps": 200, "repeats": 3}),
    Case("benchmarks.running.start", {"repeats": 9}),
    Case("benchmarks.running.logs", {"rows": 1_000_000, "repeats": 3}),
)

if __name__ == "__main__":
    measure("running", CASES)
