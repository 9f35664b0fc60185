"""The reader of binary records that CONTRIBUTING.md shows, on files that are whole and cut off."""

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = Path(__file__).resolve().parents[3] / "CONTRIBUTING.md"
BLOCKS = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.DOTALL | re.MULTILINE)
ROWS = np.arange(40.0).reshape(10, 4)


@pytest.fixture(scope="module")
def example():
    (source,) = [block for block in BLOCKS if "RECORD = " in block]
    names: dict = {}
    exec(source, names)
    return names


@pytest.mark.parametrize("cut", [0, 1, 15])
def test_whole_records_are_read_and_one_that_was_cut_off_is_not(cut, example, tmp_path):
    records = np.array([tuple(row) for row in ROWS], example["RECORD"]).tobytes()
    path = tmp_path / "log.bin"
    path.write_bytes(records[: len(records) - cut])
    found = example["content"](path)
    assert list(found) == ["millis", "pitch", "wheel", "duty"]
    assert np.array_equal(np.column_stack(list(found.values())), ROWS[: 10 if cut == 0 else 9])
