"""An evaluation of simulations as one page."""

from pathlib import Path

from twbal.core.files import write_atomically
from twbal.diagnosis.evaluation_record import CHANNEL_UNITS, SimulationEvaluation
from twbal.viz.evaluation_text import (
    angle_channels,
    closed_words,
    error_words,
    found_on_tested_on,
    judgements,
    pool,
    pool_words,
    ratio_words,
    title,
)
from twbal.viz.page import inline, render


def write_evaluation_report(path: Path, evaluation: SimulationEvaluation, picture: str) -> None:
    """Write the report; the same arguments give the same bytes.

    Args:
        path: of the page.
        evaluation: of simulations.
        picture: `evaluation_figure` as SVG text.

    Raises:
        DataError: the file cannot be written.
    """
    horizon = evaluation.headline_horizon
    shown = [score for score in evaluation.scores if score.log == pool(evaluation)]
    html = render(
        "evaluation.html.jinja",
        evaluation=evaluation,
        judgements=judgements(evaluation),
        tables=[(title(c, horizon), found_on_tested_on(evaluation, c, horizon)) for c in angle_channels(evaluation)],
        details=[(c, [score for score in shown if score.channel == c]) for c in evaluation.channels],
        words={"error": error_words, "ratio": ratio_words, "closed": closed_words},
        units=CHANNEL_UNITS,
        pool=pool_words(evaluation),
        picture=inline(picture, "evaluation", "Errors of the simulations over the horizon of their predictions"),
    )
    write_atomically(path, html)
