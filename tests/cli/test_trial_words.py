"""How `real-rollout` and `drive` say that a trial ended."""

from dataclasses import replace
from pathlib import Path

import pytest

from twbal.cli.trial_words import trial_in_words
from twbal.core.episode import Outcome
from twbal.io.logs import read_episodes

LOGS = Path(__file__).parents[2] / "data" / "regression" / "excited"


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        (Outcome.COMPLETED, "completed after"),
        (Outcome.TILT_LIMIT, "fell (tilt limit) after"),
        (Outcome.LINK_LOST, "link lost after"),
    ],
)
def test_the_end_of_a_trial_is_told_in_words_that_need_no_explanation(outcome: Outcome, words: str) -> None:
    episode = replace(read_episodes(LOGS)[0], outcome=outcome)
    assert trial_in_words(episode).startswith(f"trial {episode.provenance.trial}: {words} ")
