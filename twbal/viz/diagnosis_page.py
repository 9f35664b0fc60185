"""A diagnosis as one page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from twbal.core.files import write_atomically
from twbal.diagnosis.record import Diagnosis
from twbal.viz.headline import headline_text
from twbal.viz.map_axes import range_text
from twbal.viz.page import inline, render


@dataclass(frozen=True)
class DiagnosisSetting:
    """What a reader must know of how the diagnosis was made.

    Attributes:
        robot: its name.
        episodes: names of the logs.
        seconds: of driving in them [s].
        augmented: file with the simulation that has the named effects.
        units: of the measured channels.
        facts: further names and values, in order.
    """

    robot: str
    episodes: Sequence[str]
    seconds: float
    augmented: str
    units: Mapping[str, str]
    facts: Sequence[tuple[str, str]]


TITLES = {
    "where": "Errors of the simulation by channel and region",
    "rivals": "Evidence for each candidate",
    "gap": "Error on held-out data before and after",
    "free_form": "An added torque, force or reading over one variable",
    "reliability": "How often probabilities of effects proved right",
    "whiteness": "Autocorrelation of the residuals before and after",
}
"""Of the figures that a report may have."""


def write_diagnosis_report(
    path: Path, diagnosis: Diagnosis, setting: DiagnosisSetting, pictures: Mapping[str, str]
) -> None:
    """Write the report; the same arguments give the same bytes.

    Raises:
        DataError: the file cannot be written.
    """
    html = render(
        "diagnosis.html.jinja",
        diagnosis=diagnosis,
        setting=setting,
        headline=headline_text(diagnosis),
        worst_range=range_text(diagnosis.remaining.where[0]) if diagnosis.remaining.where else "",
        **{name: inline(pictures.get(name), name, title) for name, title in TITLES.items()},
    )
    write_atomically(path, html)
