"""The summary file reads back as it was written, and refuses what cannot be right."""

import dataclasses
import json
from pathlib import Path

import pytest

from twbal.algorithm.iteration import Iteration, PolicyFile, Search
from twbal.algorithm.summary import SimData, Summary, read_summary
from twbal.core.errors import DataError
from twbal.core.json_records import write_record


def iteration(index: int, **changes: object) -> Iteration:
    fresh = Iteration(
        index=index,
        real_episodes=index,
        real_samples=60 * index,
        real_seconds=1.2 * index,
        predicted_cost=30.0 / (index + 1),
        real_cost=60.0 / (index + 1),
        successes=index,
        trials=10,
        coverage95=0.1 + 0.2 * index,
        fit_s=2.5,
        search_s=11.0,
        drift_m=0.4,
        judged_success=1.0,
        policy=PolicyFile(f"iteration_{index}/policy.pt", f"{index:064x}"),
        note="",
    )
    return dataclasses.replace(fresh, **changes)  # type: ignore[arg-type]


def summary(count: int = 3, best: int = 1) -> Summary:
    return Summary("paper", 7, 200.5, SimData(20, 800), tuple(iteration(i) for i in range(count)), best)


def test_a_summary_reads_back_as_it_was_written(tmp_path: Path) -> None:
    unjudged = iteration(0, trials=0, successes=0, real_cost=None, coverage95=None, drift_m=None, judged_success=None)
    written = dataclasses.replace(summary(), iterations=(unjudged, iteration(1, note="Höhe <b>")), best_iteration=0)
    write_record(tmp_path / "summary.json", written)
    assert read_summary(tmp_path / "summary.json") == written


def test_what_an_older_summary_does_not_note_is_unknown(tmp_path: Path) -> None:
    path = tmp_path / "summary.json"
    write_record(path, summary())
    record = json.loads(path.read_text())
    newer = {field.name for field in dataclasses.fields(Iteration) if field.default is None}
    assert {"trial_seconds", "same_policy_as", "basis", "search"} <= newer
    record["iterations"] = [{k: v for k, v in i.items() if k not in newer} for i in record["iterations"]]
    del record["tilt_limit"]
    path.write_text(json.dumps(record))
    assert read_summary(path) == summary()
    assert read_summary(path).trial_seconds is None


def again(index: int, first: int, search: Search, **changes: object) -> Iteration:
    return iteration(index, same_policy_as=first, search=search, **changes)


def test_trials_of_one_policy_count_together_and_a_recalibration_is_no_update(tmp_path: Path) -> None:
    found = (
        iteration(0, successes=4, search=Search.FOUND),
        again(1, 0, Search.KEPT, successes=7),
        iteration(2, successes=10, search=Search.FOUND),
        again(3, 2, Search.NOT_MADE, successes=9),
    )
    about = dataclasses.replace(summary(), iterations=found, best_iteration=2)
    assert (about.count(0), about.count(2)) == ((11, 20), (19, 20))
    assert about.updates == 2
    assert about.solved
    assert [i.index for i in about.having(2)] == [2, 3]
    write_record(tmp_path / "summary.json", about)
    assert read_summary(tmp_path / "summary.json") == about


def test_trials_of_an_earlier_iteration_count_once() -> None:
    found = (iteration(0, successes=9), again(1, 0, Search.KEPT, successes=9, trials_of=0, trial_seconds=0.0))
    about = dataclasses.replace(summary(), iterations=found, best_iteration=0)
    assert (about.count(0), about.iterations[1].own_trials) == ((9, 10), 0)
    assert [len(found) for found in (about.having(0), about.tried(0))] == [2, 1]


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("search", "guessed", "must be one of 'found', 'kept', 'not made'"),
        ("same_policy_as", 1, "an earlier iteration"),
        ("trials_of", 1, "an earlier iteration"),
    ],
)
def test_a_story_that_cannot_be_is_refused(tmp_path: Path, field: str, value: object, message: str) -> None:
    write_record(tmp_path / "summary.json", summary())
    record = json.loads((tmp_path / "summary.json").read_text())
    record["iterations"][1][field] = value
    (tmp_path / "summary.json").write_text(json.dumps(record))
    with pytest.raises(DataError, match=message):
        read_summary(tmp_path / "summary.json")


def test_whole_numbers_are_read_where_fractions_are_expected(tmp_path: Path) -> None:
    write_record(tmp_path / "summary.json", dataclasses.replace(summary(), wall_s=200))
    wall = read_summary(tmp_path / "summary.json").wall_s
    assert isinstance(wall, float) and wall == 200.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"successes": 11}, "11 successes in 10 trials"),
        ({"coverage95": 1.2}, "share between 0 and 1; found 1.2"),
        ({"real_seconds": -1.0}, "real_seconds of iteration 1"),
        ({"real_cost": float("nan")}, "found nan"),
        ({"success_probability": -0.1}, "share between 0 and 1; found -0.1"),
        ({"crps_ratio": float("inf")}, "crps_ratio of iteration 1"),
        ({"log_density": float("-inf")}, "log_density of iteration 1 must be finite"),
    ],
)
def test_impossible_iterations_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(DataError, match=message):
        iteration(1, **changes)


def test_indices_must_run_from_zero_and_hold_the_best() -> None:
    with pytest.raises(DataError, match=r"in order; found \[1\]"):
        dataclasses.replace(summary(), iterations=(iteration(1),))
    with pytest.raises(DataError, match=r"one of \[0, 1, 2\]; found 3"):
        summary(best=3)


def test_a_file_that_is_no_summary_says_what_is_wrong(tmp_path: Path) -> None:
    path = tmp_path / "summary.json"
    with pytest.raises(DataError, match="no summary at"):
        read_summary(path)
    write_record(path, summary())
    good = json.loads(path.read_text())
    cases: list[tuple[object, str]] = [
        ([], "must be a record"),
        ({**good, "seed": "seven"}, "summary.seed must be a value of type int; found 'seven'"),
        ({**good, "seed": True}, "summary.seed must be a value of type int; found True"),
        ({**good, "sim": {"episodes": 3}}, "summary.sim lacks 'samples'"),
        ({**good, "speed": 1}, "summary has the unknown field 'speed'; its fields are: robot, seed"),
        ({**good, "iterations": {}}, "summary.iterations must be a list"),
        ({**good, "wall_s": 10**400}, "summary.wall_s must be a value of type float"),
    ]
    for record, message in cases:
        path.write_text(json.dumps(record))
        with pytest.raises(DataError, match=message):
            read_summary(path)
    for text in ("{", "[" * 10**5, "NaN"):
        path.write_text(text)
        with pytest.raises(DataError, match="is not JSON"):
            read_summary(path)
