"""The summary file reads back as it was written, and refuses what cannot be right."""

import dataclasses
import json
from pathlib import Path

import pytest

from twbal.errors import DataError
from twbal.summary import Iteration, PolicyFile, SimData, Summary, read_summary, summary_table, write_summary


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
    write_summary(tmp_path / "summary.json", written)
    assert read_summary(tmp_path / "summary.json") == written


def test_whole_numbers_are_read_where_fractions_are_expected(tmp_path: Path) -> None:
    write_summary(tmp_path / "summary.json", dataclasses.replace(summary(), wall_s=200))
    wall = read_summary(tmp_path / "summary.json").wall_s
    assert isinstance(wall, float) and wall == 200.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"successes": 11}, "11 successes in 10 trials"),
        ({"coverage95": 1.2}, "share between 0 and 1; found 1.2"),
        ({"real_seconds": -1.0}, "real_seconds of iteration 1"),
        ({"real_cost": float("nan")}, "found nan"),
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
    write_summary(path, summary())
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


def test_the_table_has_a_line_per_iteration_and_marks_the_best() -> None:
    text = summary_table(summary(count=4, best=2))
    body = text.splitlines()[1:5]
    assert [line.split()[:2] for line in body if "*" in line] == [["*", "2"]]
    assert "2 of 10" in body[2] and "0.50" in body[2] and "20.0" in body[2]
    assert "iteration_2/policy.pt" in text


def test_the_table_shows_a_dash_for_what_was_not_measured() -> None:
    unknown = iteration(0, trials=0, successes=0, real_cost=None, coverage95=None, drift_m=None)
    line = summary_table(dataclasses.replace(summary(), iterations=(unknown,), best_iteration=0)).splitlines()[1]
    assert line.split().count("-") == 4
