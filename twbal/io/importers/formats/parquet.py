"""Parquet files."""

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

from twbal.core.errors import LogError
from twbal.io.importers.columns import file_data

ENDINGS = (".parquet",)


def content(path: Path) -> Mapping[str, Any]:
    """The columns by name."""
    data = BytesIO(file_data(path))
    try:
        from pyarrow import parquet
    except ImportError as error:
        raise LogError(f"{path} is a Parquet file, which needs the package pyarrow; or export it as CSV.") from error
    table = parquet.read_table(data)
    return {name: table.column(name).to_numpy() for name in table.column_names}
