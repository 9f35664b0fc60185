"""Settings of benchmarks, and files of results that must not be lost."""

import pytest

from benchmarks.settings import refuse_to_replace, rows_in


def test_results_that_are_not_asked_for_are_not_replaced(tmp_path):
    file = tmp_path / "results.json"
    refuse_to_replace(file, [810, 811], [810, 811, 812])
    with pytest.raises(SystemExit, match=r"results.json holds results that are not asked for \(781\).*results="):
        refuse_to_replace(file, [781, 810], [810, 811])


def test_a_file_that_is_not_there_has_no_rows(tmp_path):
    file = tmp_path / "results.json"
    assert rows_in(file) == []
    file.write_text('{"robots": [{"seed": 1}]}')
    assert rows_in(file, "robots") == [{"seed": 1}] and rows_in(file) == []
