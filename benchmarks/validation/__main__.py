"""Run the benchmark: `python -m benchmarks.validation`; see `benchmarks.measure`. Half a minute."""

from benchmarks.measure import Case, measure

SIZES = (142, 359, 1000)

if __name__ == "__main__":
    cases = [{"f": 150, "g": n, "robots": 30, "features": 200, "steps": 500, "repeats": 9} for n in SIZES]
    measure("validation", [Case("benchmarks.validation.case", settings) for settings in cases])
