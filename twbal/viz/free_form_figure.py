"""A free-form effect as a curve with its band."""

from matplotlib.figure import Figure

from twbal.core.palette import MUTED, PREDICTED
from twbal.diagnosis.free_form_record import FreeForm
from twbal.viz.canvas import label, legend, panels, shown, styled

_OPACITY = 0.25


@styled
def free_form_figure(found: FreeForm) -> Figure:
    """Draw a quantity that is to be added over the variable that it depends on, with 95 % intervals."""
    figure, (panel,) = panels(1, columns=1, width=6.4, height=3.4)
    along, variable_unit = shown(found.variable_unit)
    up, unit = shown(found.unit)
    grid = [along * value for value in found.grid]
    low, high = ([up * value for value in ends] for ends in (found.low95, found.high95))
    panel.axhline(0.0, color=MUTED.light, linestyle=":", linewidth=1.2)
    panel.fill_between(grid, low, high, color=PREDICTED.light, alpha=_OPACITY, linewidth=0.0, label="95 % band")
    panel.plot(grid, [up * value for value in found.mean], color=PREDICTED.light, label="estimate")
    panel.set_xlabel(label(found.variable, variable_unit))
    panel.set_ylabel(label("added, less its mean", unit))
    panel.set_title(f"{found.quantity} over the {found.variable}")
    legend(figure, panel)
    return figure
