"""Names that fit below a figure stay apart."""

import pytest

from twbal.viz.short_names import short_names

X = "x" * 30


@pytest.mark.parametrize(
    ("names", "short"),
    [
        (["paper", "lqr_identified"], ["paper", "lqr_identified"]),
        (["outputs/iterate/run_of_monday", "b"], ["outputs/iterate/r…", "b"]),
        (["outputs/iterate/run", "outputs/iterate/run_2"], ["…run", "…run_2"]),
        (["runs/2026-12-01/default", "runs/2026-12-01/paper", "lqr"], ["…default", "…paper", "lqr"]),
        ([f"{X}1", "b", f"{X}2"], [f"{'x' * 15}… 1", "b", f"{'x' * 15}… 3"]),
        (["a" * 18, "a" * 19], ["a" * 18, "a" * 17 + "…"]),
        ([], []),
    ],
)
def test_long_names_lose_what_they_share_and_what_is_too_long(names, short):
    found = short_names(names)
    assert list(found) == names
    assert list(found.values()) == short


def test_no_two_of_many_names_are_alike():
    names = [f"{X}{k}" for k in range(120)] + [f"{k}" for k in range(120)]
    short = short_names(names).values()
    assert len(set(short)) == 240 and max(map(len, short)) <= 18
