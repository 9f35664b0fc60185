"""NumPy, MATLAB, JSON and Parquet files as columns."""

import json
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from twbal.core.errors import LogError, printable
from twbal.core.gaussian import Array
from twbal.io.importers.columns import LARGEST, Columns, Name, file_data, places

ENDINGS = (".npy", ".npz", ".mat", ".json", ".parquet")


def named_arrays(path: Path) -> dict[str, Array]:
    """The columns of such a file by name: (n,) each, all of the length that most numbers have.

    JSON is an object of lists, or a list of objects.
    A matrix `data` gives the columns `data:1`, `data:2`, ...; a structure `log` with a field `tilt` gives `log.tilt`.

    Raises:
        LogError: the file cannot be read, or has no columns.
    """
    try:
        found = dict(_columns("", _content(path)))
    except LogError:
        raise
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}.") from error
    except Exception as error:  # what readers raise at a damaged file is anything
        newer = " A MATLAB 7.3 file is HDF5: save it with -v7." if isinstance(error, NotImplementedError) else ""
        raise LogError(f"{path} cannot be read as a {path.suffix} file ({error}).{newer}") from error
    if not found:
        raise LogError(f"{path} has no vector or matrix of numbers.")
    lengths = [len(values) for values in found.values()]
    common = max(set(lengths), key=lambda length: length * lengths.count(length))
    return {printable(name): values for name, values in found.items() if len(values) == common}


def read_arrays(path: Path, wanted: Sequence[Name], names: Sequence[str] = ()) -> Columns:
    """Columns of such a file; arguments as of `text.read_text`.

    Raises:
        LogError: the file cannot be read, or has no such column.
    """
    found = named_arrays(path)
    known = list(names) if names and len(names) == len(found) else list(found)
    where = places(path, known, len(found), wanted)
    columns = list(found.values())
    values = np.column_stack([columns[k] for k in where])
    return Columns(values, np.arange(1, len(values) + 1), "row", ())


def _content(path: Path) -> Mapping[str, Any]:
    data = BytesIO(file_data(path))
    if path.suffix == ".mat":
        from scipy.io import loadmat  # takes a tenth of a second, and most logs are text

        whole = loadmat(data, squeeze_me=True, struct_as_record=False)
        return {name: value for name, value in whole.items() if not name.startswith("__")}
    if path.suffix == ".json":
        whole = json.load(data)
        if isinstance(whole, list):
            whole = {name: [row[name] for row in whole] for name in whole[0]}
        return {name: value for name, value in whole.items() if isinstance(value, list)}
    if path.suffix == ".parquet":
        return _parquet(path, data)
    loaded = np.load(data, allow_pickle=False)
    if isinstance(loaded, np.ndarray):
        if loaded.dtype.names:
            return {name: loaded[name] for name in loaded.dtype.names}
        return {"column": loaded}
    with loaded:
        if sum(member.file_size for member in loaded.zip.infolist()) > LARGEST:
            raise LogError(f"{path} unfolds to more than {LARGEST} bytes.")
        return {name: loaded[name] for name in loaded.files}


def _parquet(path: Path, data: BytesIO) -> dict[str, Any]:
    try:
        from pyarrow import parquet
    except ImportError as error:
        raise LogError(f"{path} is a Parquet file, which needs the package pyarrow; or export it as CSV.") from error
    table = parquet.read_table(data)
    return {name: table.column(name).to_numpy() for name in table.column_names}


def _columns(prefix: str, tree: Mapping[str, Any]) -> list[tuple[str, Array]]:
    found: list[tuple[str, Array]] = []
    for name, value in tree.items():
        if hasattr(value, "_fieldnames"):  # a MATLAB structure
            found += _columns(f"{prefix}{name}.", {field: getattr(value, field) for field in value._fieldnames})
            continue
        array = np.asarray(value)
        if array.dtype.kind not in "fiub" or array.ndim not in (1, 2):
            continue
        if array.ndim == 1:
            found.append((prefix + name, array.astype(np.float64)))
        else:
            tall = array if array.shape[0] >= array.shape[1] else array.T
            found += [(f"{prefix}{name}:{k + 1}", tall[:, k].astype(np.float64)) for k in range(tall.shape[1])]
    return found
