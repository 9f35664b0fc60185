"""MATLAB files up to version 7."""

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

from twbal.core.errors import LogError
from twbal.io.importers.columns import file_data

ENDINGS = (".mat",)


def content(path: Path) -> Mapping[str, Any]:
    """The variables by name; a structure is an object with `_fieldnames`."""
    from scipy.io import loadmat  # takes a tenth of a second, and most logs are text

    data = BytesIO(file_data(path))
    try:
        whole = loadmat(data, squeeze_me=True, struct_as_record=False)
    except NotImplementedError as error:
        raise LogError(
            f"{path} cannot be read as a .mat file ({error}). A MATLAB 7.3 file is HDF5: save it with -v7."
        ) from error
    return {name: value for name, value in whole.items() if not name.startswith("__")}
