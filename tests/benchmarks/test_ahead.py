"""What the default needs by several seeds, and what PILCO could be ahead by."""

from benchmarks.hidden_robots.ahead import default_seeds, pilco_ahead

RUNS = [{"seed": 1, "updates": 0, "seconds": 0.0}, {"seed": 2, "updates": 2, "seconds": 5.0}]
LOST = {"seed": 3, "updates": None, "seconds": None}


def test_runs_are_counted_by_the_updates_that_they_took():
    robots = [{"family": "hard", "robot": 781, "default": [*RUNS, LOST]}]
    line = "| 1 | 3 | 1 of 3 | 1 of 3 | 2 of 3 | 2 of 3 | 5.0 s / never |"
    assert default_seeds({"robots": robots})[2:] == [f"| hard {line}", f"| all {line}"]


def test_pilco_may_be_ahead_by_half_the_driving_where_it_is_not_by_3_s():
    runs = [{"seed": 1, "updates": 1, "seconds": 2.4}] * 3
    pilco = [{"seed": 1, "seconds": 0.7, "successes": 0, "trial_seconds": 0.4}] * 3
    robot = {"family": "esp32", "robot": 947, "updates": 1, "seconds": 1.2, "default": runs, "pilco": pilco}
    *_, line = pilco_ahead({"robots": [robot]})
    assert line.endswith("| 0 of 10 | 1.1 s | no | yes |")
