"""A fitted simulation with other values that the recordings leave possible.

Where held-out data ask for what the fitted data hardly showed, such as how far the wheels come apart when the robot
turns, rollouts go wrong although the form of the simulation is right.
"""

import numpy as np

from twbal.diagnosis.data_sheet import WHEELS
from twbal.diagnosis.findings import Effects
from twbal.diagnosis.hypothesis import FittedHypothesis
from twbal.sysid.intervals import drawn_values
from twbal.sysid.model import Data
from twbal.sysid.prediction_error_fit import slopes_of

_DRAWS = 6


def drawn_effects(data: Data, hypothesis: FittedHypothesis, effects: Effects, blocks: int) -> tuple[Effects, ...]:
    """Effects with values drawn from what the data leave open.

    The wheels' mass and inertia, for which the simulation has no effect, stay as they are.

    Args:
        data: that the hypothesis was fitted to.
        hypothesis: whose standard errors these are.
        effects: values of it as the simulation takes them, about which is drawn.
        blocks: into which the data are cut, as of `standard_errors`.
    """
    fit, found = hypothesis.fit, []
    J, excess = slopes_of(data, fit), data.slope_excess
    for values in drawn_values(fit, J, blocks, hypothesis.temperature, WHEELS, _DRAWS, excess):
        drawn = {name: dict(parameters) for name, parameters in effects.items()}
        for free in fit.free_parameters:
            if free.field in values and free.effect in effects:
                value = effects[free.effect][free.parameter] + values[free.field] - fit.model.value(free.field)
                drawn[free.effect][free.parameter] = float(np.clip(value, free.low, free.high))
        found.append(drawn)
    return tuple(found)
