"""A free-form effect as a curve with its band."""

from matplotlib.figure import Figure

from twbal.core.palette import MUTED, PREDICTED
from twbal.diagnosis.free_form_record import FreeForm
from twbal.viz.canvas import label, legend, panels, styled

_OPACITY = 0.25


@styled
def free_form_figure(found: FreeForm) -> Figure:
    """Draw a quantity that is to be added over the variable that it depends on, with 95 % intervals.

    Both are in SI units, as in the sentence beside the figure.
    """
    figure, (panel,) = panels(1, columns=1, width=6.4, height=3.4)
    panel.axhline(0.0, color=MUTED.light, linestyle=":", linewidth=1.2)
    ends = found.low95, found.high95
    panel.fill_between(found.grid, *ends, color=PREDICTED.light, alpha=_OPACITY, linewidth=0.0, label="95 % band")
    panel.plot(found.grid, found.mean, color=PREDICTED.light, label="estimate")
    panel.set_xlabel(label(found.variable, found.variable_unit))
    panel.set_ylabel(label("added, less its mean", found.unit))
    panel.set_title(f"{found.quantity} over the {found.variable}")
    legend(figure, panel)
    return figure
