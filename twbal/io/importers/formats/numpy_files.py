"""NumPy files: an array, an array with named fields, or several arrays."""

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from twbal.core.errors import LogError
from twbal.io.importers.columns import LARGEST, file_data

ENDINGS = (".npy", ".npz")


def content(path: Path) -> Mapping[str, Any]:
    """The arrays by name; one without a name is `column`."""
    loaded = np.load(BytesIO(file_data(path)), allow_pickle=False)
    if isinstance(loaded, np.ndarray):
        if loaded.dtype.names:
            return {name: loaded[name] for name in loaded.dtype.names}
        return {"column": loaded}
    with loaded:
        if sum(member.file_size for member in loaded.zip.infolist()) > LARGEST:
            raise LogError(f"{path} unfolds to more than {LARGEST} bytes.")
        return {name: loaded[name] for name in loaded.files}
