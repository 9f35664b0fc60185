"""Run the benchmark: `python -m benchmarks.moment_matching [peer=false]`; see `benchmarks.measure`."""

import sys
from collections.abc import Iterator, Sequence
from typing import Any

from benchmarks.measure import Case, measure

OURS, PEER = "benchmarks.moment_matching.case", "benchmarks.moment_matching.peer"
SIZES = (100, 300, 1000)
MOST = 10_000


def cases() -> Iterator[Case]:
    """What is timed, the cheap ones first."""
    for policy in ("found", "random"):
        for keep in (False, True):
            for n in SIZES:
                settings = {"n": n, "policy": policy, "keep_variance": keep, "difference": 0}
                yield Case(OURS, {**settings, "repeats": 7 if n < 1000 else 3, "exact": n < 1000})
        yield Case(OURS, unchecked(1000, policy, difference=300))
    yield Case(OURS, unchecked(MOST, "found"))


def unchecked(n: int, policy: str, difference: int = 0) -> dict[str, Any]:
    """f, or f + g with g's variance kept, not compared with the sums over all pairs."""
    return {"n": n, "policy": policy, "keep_variance": False, "difference": difference, "repeats": 3, "exact": False}


def peers() -> Iterator[Case]:
    """The peer at the sizes that fit into memory; its time does not depend on how wide the states spread."""
    for n, horizon, repeats in ((100, 100, 3), (300, 25, 1)):
        yield Case(PEER, {"n": n, "policy": "random", "horizon": horizon, "repeats": repeats})


def main(words: Sequence[str]) -> None:
    """Run what is not there yet."""
    measure("moment_matching", [*cases(), *(peers() if "peer=false" not in words else ())])
    measure("moment_matching_profile", [Case("benchmarks.moment_matching.profile", {"n": n}) for n in (*SIZES, MOST)])


if __name__ == "__main__":
    main(sys.argv[1:])
