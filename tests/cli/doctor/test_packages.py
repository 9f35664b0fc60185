"""Versions are held against what is needed and what was tested; kernels against the folder that keeps them."""

from importlib import metadata

import pytest

from twbal.cli.doctor.packages import kernels_check, package_checks, packages_check, pinned_versions, python_check
from twbal.core.check import CheckStatus

NEEDS = ["small>=1.2", "exact==2.0", "extra>=9; extra == 'rl'"]


def judged(installed, pins=None):
    return packages_check(NEEDS, pins or {}, installed.get)


def test_what_fits_is_ok_and_extras_are_not_needed():
    check = judged({"small": "1.3", "exact": "2.0+cpu"}, {"small": "1.3", "exact": "2.0"})
    assert (check.verdict, check.advice) == (CheckStatus.OK, "")
    assert check.found == "all 2 that twbal needs, in the versions of constraints.txt"


@pytest.mark.parametrize(
    ("installed", "said"),
    [
        ({"exact": "2.0"}, "small is not installed"),
        ({"small": "1.1", "exact": "2.0"}, "small is 1.1, not >=1.2"),
        ({"small": "1.10", "exact": "2.1"}, "exact is 2.1, not ==2.0"),  # 1.10 is more than 1.2
    ],
)
def test_what_does_not_fit_is_a_problem(installed, said):
    check = judged(installed)
    assert (check.verdict, check.found) == (CheckStatus.PROBLEM, said)
    assert "pip install" in check.advice


def test_what_fits_but_was_not_tested_is_a_warning():
    check = judged({"small": "1.9", "exact": "2.0"}, {"small": "1.3", "exact": "2.0"})
    assert (check.verdict, check.found) == (CheckStatus.WARNING, "small 1.9 (tested with 1.3)")


@pytest.mark.parametrize(("found", "verdict"), [("3.11.9", "ok"), ("3.12.0", "problem"), ("3.9.2", "problem")])
def test_python_is_held_against_its_range(found, verdict):
    assert python_check(">=3.11,<3.12", found).verdict == verdict


def test_an_environment_without_twbal_is_a_problem(monkeypatch):
    def none_of_that_name(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "metadata", none_of_that_name)
    (check,) = package_checks({})
    assert (check.verdict, check.found) == (CheckStatus.PROBLEM, "twbal itself is not installed")


def test_pins_are_read_as_pip_reads_them(tmp_path):
    file = tmp_path / "constraints.txt"
    file.write_text("# one==0\nnumpy==2.1.0\nmcap==1.6.0\n")
    assert pinned_versions(file) == {"numpy": "2.1.0", "mcap": "1.6.0"}
    assert pinned_versions(tmp_path / "none") == {}


def test_kernels_that_are_kept_are_ok_and_none_or_lost_ones_a_warning(tmp_path, monkeypatch):
    assert kernels_check(tmp_path).verdict is CheckStatus.WARNING  # it lies among temporary files
    monkeypatch.setattr("tempfile.tempdir", "/somewhere/else")
    assert kernels_check(tmp_path).found.startswith("none yet")
    (tmp_path / "search").mkdir()
    (tmp_path / "search" / "one.nbc").touch()
    check = kernels_check(tmp_path)
    assert (check.verdict, check.found) == (CheckStatus.OK, f"1 in {tmp_path}")
    assert kernels_check(tmp_path / "gone").verdict is CheckStatus.PROBLEM


def test_kernels_of_many_other_versions_are_told(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", "/somewhere/else")
    folders = [tmp_path / f"kernels-{version}" for version in range(11)]
    for folder in folders:
        folder.mkdir()
        (folder / "one.nbc").touch()
    check = kernels_check(folders[0])
    assert (check.verdict, check.found) == (
        CheckStatus.OK,
        f"1 in {folders[0]}, and folders of 10 other versions beside it",
    )
    folders[-1].rename(tmp_path / "other")
    assert kernels_check(folders[0]).found == f"1 in {folders[0]}"
