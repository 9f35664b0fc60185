"""Files that are either wholly there or not at all, and what names their content."""

import errno
import fcntl
import hashlib
import json
import os
import secrets
import stat
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader
from itertools import count
from pathlib import Path
from typing import Any, BinaryIO

from twbal.core.errors import DataError


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Open a file that takes the place of `path` once it is written, flushed to the disk and closed.

    A process killed on the way leaves the old file, if there was one, and at most a hidden `.partial` beside it.
    Missing parent folders are made.

    Raises:
        DataError: the file cannot be written.
    """
    # A process id alone would name two files alike where machines share the disk.
    partial = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with partial.open("wb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        partial.replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        raise DataError(
            f"Cannot write {path}: {error.strerror or error}. Is there room on the disk, and may you write there?"
        ) from error
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)


def write_atomically(path: Path, data: bytes | str) -> None:
    """Write `data` (text as UTF-8) to `path`, wholly or not at all.

    Raises:
        DataError: the file cannot be written.
    """
    with replacing(path) as stream:
        stream.write(data.encode() if isinstance(data, str) else data)


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Wait until no other process is in here with the same folder, and keep others waiting.

    The lock is on a hidden file, and goes with the process however that ends. Where the disk knows no locks, nobody
    waits.

    Raises:
        DataError: the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as error:
        raise DataError(f"Cannot write to {folder}: {error.strerror or error}. May you write there?") from error
    try:
        _lock(handle, folder)
        yield
    finally:
        os.close(handle)


def _lock(handle: int, folder: Path) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        print(f"waiting for another process that works in {folder}", file=sys.stderr, flush=True)
        fcntl.flock(handle, fcntl.LOCK_EX)
    except OSError:  # such as network disks without locks
        return


def read_bounded(path: Path, largest: int) -> bytes:
    """The content of an ordinary file of at most `largest` bytes: never a pipe that nobody writes to, nor a device.

    Raises:
        OSError: there is no such file, it may not be read, is larger, or is something else; `strerror` says which.
    """
    with _ordinary(path) as stream:
        data = stream.read(largest + 1)
    if len(data) > largest:
        raise OSError(errno.EFBIG, f"it has more than {largest} bytes", str(path))
    return data


def read_json(path: Path, largest: int = 2**26) -> Any:
    """The value in a JSON file of at most `largest` bytes; NaN and infinities are no JSON.

    Raises:
        FileNotFoundError: it is not there.
        DataError: it cannot be read, or is not JSON.
    """
    try:
        return json.loads(read_bounded(path, largest), parse_constant=_refuse_constant)
    except FileNotFoundError:
        raise
    except OSError as error:
        raise DataError(f"{path} cannot be read: {error.strerror or error}.") from error
    except (ValueError, RecursionError) as error:
        raise DataError(f"{path} is not JSON ({error}).") from error


def _refuse_constant(name: str) -> None:
    raise ValueError(f"it has {name}")


def _ordinary(path: Path) -> BufferedReader:
    """Open an ordinary file for reading; raises `OSError` for whatever else `path` may be."""
    # Not blocking: opening a pipe would wait for somebody to write to it.
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    mode = os.fstat(handle).st_mode
    if stat.S_ISREG(mode):
        return os.fdopen(handle, "rb")
    os.close(handle)
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder", str(path))
    raise OSError(errno.EINVAL, "it is a pipe or a device, and no file", str(path))


def file_hash(path: Path) -> str:
    """sha256 of the content of `path`, in hex.

    Raises:
        DataError: the file cannot be read.
    """
    try:
        with _ordinary(path) as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except IsADirectoryError as error:
        raise DataError(f"{path} is a folder; expected is a file{one_within(path, '.pt', '.mcap')}.") from error
    except OSError as error:
        raise DataError(f"Cannot read {path}: {error.strerror or error}.") from error


def one_within(folder: Path, *endings: str) -> str:
    """Words that name a file in a folder, or in one right below it, as an example of what is expected; "" without one.

    Args:
        folder: that was given in place of a file.
        endings: of the files that may be meant, the likeliest first.
    """
    forms = [form for ending in endings for form in (f"*{ending}", f"*/*{ending}")]
    example = next((path for form in forms for path in sorted(folder.glob(form))), None)
    return f", such as {example}" if example is not None else ""


def _sync_folder(folder: Path) -> None:
    # The rename is an entry of the folder: without this a power cut may undo it.
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def unused(name: str, used: Collection[str]) -> str:
    """The name of a file; with a number behind it, from 2 on, where another is called so."""
    return name if name not in used else next(other for k in count(2) if (other := f"{name}_{k}") not in used)
