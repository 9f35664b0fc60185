"""All benchmarks one after another: `python -m benchmarks`, or `make bench`."""

from benchmarks.hidden_robots.__main__ import main as hidden_robots

if __name__ == "__main__":
    hidden_robots([])
    hidden_robots(["experiment=paper"])
