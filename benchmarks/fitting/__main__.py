"""Run the benchmark: `python -m benchmarks.fitting`; see `benchmarks.measure`. Four hours, mostly BoTorch's."""

from collections.abc import Iterator

from benchmarks.measure import Case, measure

SETS = {100: 20, 300: 20, 1000: 20}  # data sets by samples
STARTS = 20  # of BoTorch on each


def cases() -> Iterator[Case]:
    """Every data set, the small ones first."""
    for n, sets in SETS.items():
        for seed in range(sets):
            yield Case("benchmarks.fitting.case", {"n": n, "seed": seed, "starts": STARTS})


if __name__ == "__main__":
    measure("fitting", cases())
