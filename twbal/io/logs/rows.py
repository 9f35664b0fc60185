"""An episode as one table of numbers, a row for each sample, in the order of the log's fields."""

import numpy as np

from twbal.core.episode import Episode
from twbal.core.gaussian import Array
from twbal.core.plant import Observation

_SEEN = ("time", "tilt", "tilt_rate", "acceleration", "yaw_rate", "wheel_angle", "wheel_rate")  # /imu, then /wheels


def columns_of(episode: Episode) -> Array:
    """/imu, /wheels, /state, /pose, /reference, /heading and /command side by side, (T + 1, 7 + D + 4 + 3 + 5 + 1).

    An episode without poses lacks those 4 columns, one without a reference those 3, one whose heading nothing
    controlled those 5. The last row has no command, so NaN.
    """
    seen = episode.observations[:, [Observation._fields.index(name) for name in _SEEN]]
    optional = [values for values in (episode.poses, episode.references, episode.headings) if values is not None]
    return np.column_stack([seen, episode.states, *optional, np.append(episode.commands, np.nan)])


def observations_of(seen: Array) -> Array:
    """(T + 1, 7) in the order of `Observation`, from the columns of /imu and /wheels, (T + 1, 7)."""
    return seen[:, [_SEEN.index(name) for name in Observation._fields]]
