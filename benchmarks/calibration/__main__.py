"""`python -m benchmarks.calibration [records=benchmarks/results/other_robots_calibrating.json]`.

Fits the correction of the probabilities of `twbal diagnose` (`twbal/diagnosis/calibration.py`) to records of
`benchmarks.other_robots`, and writes `twbal/diagnosis/calibration.json`. Robots of these records must not serve to
measure how well probabilities are calibrated: they are no longer blind.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.calibration.fit import fitted
from benchmarks.settings import text_settings
from twbal.core.json_records import write_record
from twbal.diagnosis.calibration import FILE

DEFAULTS = {"records": "benchmarks/results/other_robots_calibrating.json"}


def main(words: Sequence[str]) -> None:
    """Fit, write and print."""
    settings = text_settings(DEFAULTS, words, __doc__ or "")
    found = fitted(Path(settings["records"]))
    write_record(FILE, found)
    print(f"intercept {found.intercept:.3f}, slope {found.slope:.3f}, shares {dict(found.shares)}")
    for each in found.reliability:
        print(f"{each.low:.1f}-{each.high:.1f}: {each.pairs} pairs, said {each.said:.2f}, right {each.right:.2f}")


if __name__ == "__main__":
    main(sys.argv[1:])
