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


@dataclass(frozen=True)
class DiagnosisPictures:
    """The figures as SVG text; None where there is nothing to draw."""

    where: str
    rivals: str | None
    gap: str | None
    whiteness: str
    free_form: str | None = None


def write_diagnosis_report(
    path: Path, diagnosis: Diagnosis, setting: DiagnosisSetting, pictures: DiagnosisPictures
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
        where=inline(pictures.where, "where", "Errors of the simulation by channel and region"),
        rivals=inline(pictures.rivals, "rivals", "Evidence for each candidate"),
        gap=inline(pictures.gap, "gap", "Error on held-out data before and after"),
        free_form=inline(pictures.free_form, "free_form", "An added torque, force or reading over one variable"),
        whiteness=inline(pictures.whiteness, "whiteness", "Autocorrelation of the residuals before and after"),
    )
    write_atomically(path, html)
