"""What policies survive, as one page."""

from twbal.algorithm.robustness import PARTS, UPRIGHT, Robustness
from twbal.viz.page import inline, percent, render


def robustness_page(robustness: Robustness, picture: str) -> str:
    """The page; the same arguments give the same text.

    Args:
        robustness: of methods.
        picture: `robustness_figure` as SVG text.
    """
    return render(
        "robustness.html.jinja",
        robustness=robustness,
        rows=table_rows(robustness),
        missed=_missed(robustness),
        parts=[part.replace("_", " ") for part in PARTS],
        robots=sorted({(p.robot, p.seed) for method in robustness.methods for p in method.policies}),
        picture=inline(picture, "robustness", "Share of successes over the levels of each axis"),
    )


def table_rows(robustness: Robustness) -> list[list[str]]:
    """A head and a row a method: as it is, the mean of each axis, all, the worst robot, and all that stayed upright."""
    names = [axis.name.replace("_", " ") for axis in robustness.axes]
    rows = [["method", "unchanged", *names, "overall", "worst robot", "overall, upright"]]
    for method in robustness.methods:
        means = [method.mean(axis.name) for axis in robustness.axes]
        shares = [method.unchanged(), *means, method.overall(), method.least, method.overall(UPRIGHT)]
        rows.append([method.name, *map(percent, shares)])
    return rows


def _missed(robustness: Robustness) -> list[tuple[str, list[list[str]]]]:
    """For each axis a row a method: the mean share of trials that have each part of success."""
    return [
        (
            axis.name.replace("_", " "),
            [[m.name, *(percent(m.mean(axis.name, part)) for part in PARTS)] for m in robustness.methods],
        )
        for axis in robustness.axes
    ]
