"""Where fits begin of a set to which a filter of the tilt was just added.

What such a filter is misled by, and an error of the tilt that lasts as long and that no model knows of
(`NoiseModel.discrepancy`), explain each other away. The likelihood has an optimum where the filter is slow and most is
left to the error, and another one where it is as fast as it is; a search that begins near the first does not leave it.
"""

from collections.abc import Sequence

from twbal.diagnosis.candidates import Candidate
from twbal.planar.robot_distribution import TILT_FILTER
from twbal.sysid.model import Model

_RATES = (1.0, 4.0)  # 1/s; at which firmware follows the accelerometer
_OWN_ERROR = 0.15  # share that is left of the tilt's own error
_LASTS = 0.3  # share of the tilt's white noise from which on an error that lasts may come from a filter
_TILT = 2  # its place among the components of a model discrepancy


def has_lasting_tilt_error(model: Model) -> bool:
    """Whether the tilt has an error that lasts, and is no less than a share of its white noise."""
    return bool(model.noise.discrepancy[_TILT] > _LASTS * model.noise.sensors[0])


def filter_starts(model: Model, added: Sequence[Candidate], period: float) -> list[Model]:
    """Further models from which to fit; none where no filter of the tilt is among the candidates that were added.

    Args:
        model: with what was added.
        added: candidates.
        period: control period [s].
    """
    found = list[Model]()
    for candidate in added:
        if candidate.name == TILT_FILTER:
            rate, lead = (candidate.field(p) for p in candidate.parameters)
            discrepancy = model.noise.discrepancy.copy()
            discrepancy[_TILT] *= _OWN_ERROR
            quieter = model._replace(noise=model.noise._replace(discrepancy=discrepancy))
            found += [quieter.put({rate: value, lead: 0.5 * period}) for value in _RATES]
    return found
