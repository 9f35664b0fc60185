"""Tables of policies 0 and of several seeds, from results that are made up."""

import json

from benchmarks.hidden_robots import tables


def robot(seed, successes, **more):
    trial = {"upright": True, "succeeded": True}
    trials = [{"default": trial if n < successes else {"upright": False, "succeeded": False}} for n in range(10)]
    return {"seed": seed, "iterations": [{"trials": trials}], **more}


def test_policies_0_stand_beside_those_of_the_same_robots_from_the_data_sheet(tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "RESULTS", tmp_path)
    nominal = [robot(7, 10), robot(3, 0), robot(4, 4)]
    (tmp_path / "hidden_robots_hard.json").write_text(json.dumps({"robots": nominal}))
    corrected = [robot(3, 10, seconds_before=1.25), robot(4, 5, seconds_before=10.0)]
    _, _, *rows = tables.first_policies({"family": "hard", "robots": corrected})
    assert rows == [
        "| robots on which all ten trials succeed | 0 of 2 | 1 of 2 |",
        "| robots on which at least half of them do | 0 of 2 | 2 of 2 |",
        "| trials that succeed | 4 of 20 | 15 of 20 |",
        "| trials in which the robot stays upright | 4 of 20 | 15 of 20 |",
        "| robots on which fewer do (successes) | not listed | 4 (5) |",
        "| length of the rollout, shortest / median | - | 1.2 s / 5.6 s |",
    ]


def test_each_seed_has_its_updates_and_seconds_or_never():
    def run(recipe, *steps):
        iterations = [
            {"index": i, "successes": won, "trials": 10, "real_seconds": s} for i, (won, s) in enumerate(steps)
        ]
        return {"recipe": recipe, "iterations": iterations}

    runs = [run("default", (9, 0.0), (10, 2.5), (10, 4.0)), run("default", (10, 0.0)), run("pilco", (0, 1.0), (9, 9.0))]
    _, _, *rows = tables.three_seeds({"runs": runs})
    assert rows == ["| default | 1, 0 | 2.5 s, 0.0 s |", "| pilco | never | never |"]


def test_a_policy_that_was_kept_has_no_trials_of_its_own_and_is_no_failure():
    hidden = {"torque_gain": 1.0, "dead_zone": 0.1, "delay_ms": 5.0, "coulomb_friction": 0.1}
    hidden |= {"body_mass": 1.0, "com_height": 1.0, "com_offset_deg": 0.0}
    trial = {rule: {"succeeded": True} for rule in ("default", "sticky")} | {"farthest": 0.03}
    steps = [{"index": i, "trials": [trial] * n, "real_seconds": 2.0 * i} for i, n in enumerate((10, 0, 10))]
    robot = {"seed": 7, "hidden": hidden, "reference": {"is_sticky": False}, "best": 0, "iterations": steps}
    assert "| 10, -, 10 | 10, -, 10 |" in tables.robots({"robots": [robot]})[-1]
