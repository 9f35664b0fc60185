"""Models and policies in a file: tensors and plain values only, so that reading one never runs code.

The file is what `torch.save` writes, and holds
`{"format": "twbal checkpoint", "schema_version": 1, "kind": ..., "payload": ...}`. See docs/formats.md.
"""

import hashlib
import pickle
import re
import sys
import zipfile
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from twbal.core.errors import CheckpointError
from twbal.core.files import read_bounded, write_atomically

FORMAT = "twbal checkpoint"
SCHEMA_VERSION = 1
_ALLOWED = "dict (with text keys), list, tuple, str, int, float, bool, None, numpy arrays of numbers and torch tensors"
_ZIP_START = b"PK\x03\x04"
_LARGEST = 2**32  # bytes of a file
_DEEPEST = 32  # dicts and lists within each other


def save_checkpoint(path: Path, kind: str, payload: dict[str, Any]) -> str:
    """Write `payload` to `path`, wholly or not at all; the same content gives the same bytes.

    Args:
        kind: what it is ("model", "policy"); `load_checkpoint` asks for it.
        payload: nested dicts, lists, tuples, plain values, numpy arrays and tensors.

    Returns:
        sha256 of the file, in hex.

    Raises:
        CheckpointError: the payload holds something else.
        DataError: the file cannot be written.
    """
    data = _content(kind, payload)
    write_atomically(path, data)
    return hashlib.sha256(data).hexdigest()


def checkpoint_hash(kind: str, payload: dict[str, Any]) -> str:
    """sha256, in hex, of the file that `save_checkpoint` would write.

    Raises:
        CheckpointError: the payload holds what a checkpoint cannot.
    """
    return hashlib.sha256(_content(kind, payload)).hexdigest()


def _content(kind: str, payload: dict[str, Any]) -> bytes:
    """The bytes of a file."""
    import torch  # here, so that what needs no tensor starts without it

    content = {"format": FORMAT, "schema_version": SCHEMA_VERSION, "kind": kind, "payload": payload}
    # Into memory first: written to a path, torch names the folder inside the file after the file.
    buffer = BytesIO()
    torch.save(_pack(content, "checkpoint"), buffer)
    return buffer.getvalue()


def load_checkpoint(path: Path, kind: str) -> dict[str, Any]:
    """Read what `save_checkpoint` wrote; tensors come back as numpy arrays.

    Args:
        kind: what the caller needs ("model", "policy").

    Raises:
        CheckpointError: the file is missing, cut, damaged, not a checkpoint, of another kind or schema version, or
            needs code to load.
    """
    data = _read_zip(path)
    content = _load_tensors(path, data)
    _check_extent(content, len(data), path)
    if not isinstance(content, dict) or not _is(content.get("format"), FORMAT):
        raise CheckpointError(
            f"{path} is a torch file, but not a checkpoint of twbal (it holds {_describe(content)}). "
            "Give a model.pt or policy.pt that a twbal stage wrote."
        )
    version, found = content.get("schema_version"), content.get("kind")
    if not _is(version, SCHEMA_VERSION):
        raise CheckpointError(
            f"Checkpoint {path} has schema version {str(version)[:40]}; this twbal reads version {SCHEMA_VERSION}. "
            "Install the version of twbal that wrote it (its run folder's manifest.json names it)."
        )
    if not _is(found, kind):
        raise CheckpointError(
            f"Checkpoint {path} holds a {str(found)[:40]!r}, expected a {kind!r}. Was another file meant?"
        )
    payload = _unpack(content.get("payload"), path)
    if not isinstance(payload, dict):
        raise CheckpointError(f"Checkpoint {path} has no payload; found {_describe(payload)}. Make it again.")
    return payload


def _pack(value: Any, where: str) -> Any:
    """A fresh tree of tensors and plain values, equal to `value`, in which only equal strings are the same object.

    The pickle inside the file says which objects are the same one, so a string or an array that two places share would
    otherwise give other bytes than two equal ones.
    """
    import torch

    if isinstance(value, str):
        return sys.intern(str(value))
    if isinstance(value, torch.Tensor):
        return value.detach().cpu().clone(memory_format=torch.contiguous_format)
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.dtype != np.longdouble:
        return torch.from_numpy(np.array(value, dtype=value.dtype.newbyteorder("="), order="C"))
    if value is None or type(value) in (bool, int) or isinstance(value, float):
        return float(value) if isinstance(value, float) else value
    if type(value) in (list, tuple):
        return type(value)([_pack(item, f"{where}[{i}]") for i, item in enumerate(value)])
    if type(value) is dict and all(isinstance(key, str) for key in value):
        return {sys.intern(str(key)): _pack(item, f"{where}[{key!r}]") for key, item in value.items()}
    raise CheckpointError(f"{where} is {_describe(value)}, which a checkpoint cannot hold. It can hold: {_ALLOWED}.")


def _check_extent(content: Any, size: int, path: Path) -> None:
    """Refuse content that a file of `size` bytes cannot hold as it is: values that stand for many, or hold themselves.

    A pickle may name the same list many times, in a list that is named many times, and a tensor may have any shape
    over a single number.
    """
    import torch

    ahead, extent = [(content, 0)], 0
    while ahead:
        value, depth = ahead.pop()
        extent += value.numel() * value.element_size() if isinstance(value, torch.Tensor) else 1
        if extent > size or depth > _DEEPEST:
            raise CheckpointError(
                f"Checkpoint {path} holds more than its {size} bytes can: values that repeat, or contain themselves. "
                "twbal writes no such file; do not use it."
            )
        within = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
        ahead.extend((item, depth + 1) for item in within)


def _is(found: Any, expected: str | int) -> bool:
    """Whether a value of any kind is this very text or number."""
    return type(found) is type(expected) and bool(found == expected)


def _unpack(value: Any, path: Path) -> Any:
    """`value` with its tensors as numpy arrays."""
    import torch

    if isinstance(value, torch.Tensor):
        try:
            array = value.numpy()
        except (RuntimeError, TypeError) as error:
            raise CheckpointError(f"Checkpoint {path} holds a tensor that numpy cannot hold: {error}") from error
        if array.dtype.kind in "fiub":
            return array
        value = array
    if type(value) in (list, tuple):
        return type(value)([_unpack(item, path) for item in value])
    if type(value) is dict and all(isinstance(key, str) for key in value):
        return {key: _unpack(item, path) for key, item in value.items()}
    if value is None or type(value) in (bool, int, float, str):
        return value
    raise CheckpointError(f"Checkpoint {path} holds {_describe(value)}. It can hold: {_ALLOWED}.")


def _read_zip(path: Path) -> bytes:
    """The bytes of a torch file whose parts are all whole."""
    try:
        data = read_bounded(path, _LARGEST)
    except FileNotFoundError:
        raise CheckpointError(
            f"There is no checkpoint {path}. Check the path, or run the stage that makes it."
        ) from None
    except IsADirectoryError as error:
        raise CheckpointError(
            f"{path} is a folder; expected is a checkpoint, such as best_policy.pt, policy.pt or model.pt in it."
        ) from error
    except OSError as error:
        raise CheckpointError(f"Cannot read checkpoint {path}: {error.strerror or error}.") from error
    if not data.startswith(_ZIP_START):
        raise CheckpointError(_not_a_checkpoint(path, data))
    try:
        # torch does not look at the checksums, and would hand out damaged numbers.
        with zipfile.ZipFile(BytesIO(data)) as archive:
            unfolded = sum(part.file_size for part in archive.infolist())
            damaged = archive.testzip() if unfolded <= len(data) else None
    except Exception as error:  # zipfile lets errors of many kinds through on damaged files
        raise CheckpointError(
            f"Checkpoint {path} is cut or damaged after {len(data)} bytes ({error}). Make it again, or take a copy."
        ) from error
    if unfolded > len(data):
        raise CheckpointError(
            f"Checkpoint {path} of {len(data)} bytes unfolds into {unfolded}; a checkpoint of twbal is not compressed."
        )
    if damaged is not None:
        raise CheckpointError(f"Checkpoint {path} is damaged (checksum of {damaged}). Make it again, or take a copy.")
    return data


def _load_tensors(path: Path, data: bytes) -> Any:
    import torch

    try:
        return torch.load(BytesIO(data), map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        needed = re.search(r"GLOBAL (\S+)", str(error))
        raise CheckpointError(
            f"Checkpoint {path} needs code to load ({needed.group(1) if needed else 'an unknown object'}) and is "
            "refused: loading it could run anything. A checkpoint of twbal holds tensors and plain values only."
        ) from error
    except Exception as error:  # torch lets errors of many kinds through on zips that it did not write
        raise CheckpointError(f"{path} is a zip file, but not a checkpoint ({error}).") from error


def _not_a_checkpoint(path: Path, data: bytes) -> str:
    if _ZIP_START.startswith(data):
        return f"Checkpoint {path} is cut: only {len(data)} bytes are left. Make it again, or take a copy."
    if data[:1] == b"\x80":
        return (
            f"{path} is a bare pickle, which needs code to load and is refused: loading it could run anything. "
            "A checkpoint of twbal holds tensors and plain values only."
        )
    return f"{path} is not a checkpoint (it begins with {data[:8]!r}). Give a model.pt or policy.pt that a stage wrote."


def _describe(value: Any) -> str:
    kind = type(value)
    name = kind.__name__ if kind.__module__ == "builtins" else f"{kind.__module__}.{kind.__name__}"
    return f"a {name}" + (f" of {value.dtype}" if isinstance(value, np.ndarray) else "")
