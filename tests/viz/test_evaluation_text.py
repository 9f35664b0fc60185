"""What the table of evaluated simulations says in words."""

import pytest

from twbal.viz.evaluation_text import ratio_words


class Score:
    """What `ratio_words` reads of a score."""

    ratio95 = None

    def __init__(self, ratio):
        self.ratio = ratio


@pytest.mark.parametrize(
    ("ratio", "words"), [(None, "-"), (1.0, "× 1.00"), (11.173, "× 11.17"), (0.12, "× 0.12"), (0.00361, "× 0.0036")]
)
def test_a_small_ratio_is_never_shown_as_nothing(ratio, words):
    assert ratio_words(Score(ratio)) == words
