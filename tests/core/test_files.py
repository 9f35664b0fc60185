import hashlib
import os
import threading
from pathlib import Path

import pytest

from twbal.core.errors import DataError
from twbal.core.files import alone_in, file_hash, read_bounded, read_json, replacing, write_atomically


def test_bytes_and_text_are_written_with_their_folders(tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "file"
    write_atomically(path, b"\x00\xff")
    assert path.read_bytes() == b"\x00\xff"
    write_atomically(path, "20 N·m\n")
    assert path.read_text(encoding="utf-8") == "20 N·m\n"
    assert [entry.name for entry in path.parent.iterdir()] == ["file"]


def test_writing_that_fails_on_the_way_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "file"
    write_atomically(path, "old")
    with pytest.raises(KeyboardInterrupt), replacing(path) as stream:
        stream.write(b"half")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


def test_the_file_is_not_there_before_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "file"
    with replacing(path) as stream:
        stream.write(b"half")
        stream.flush()
        assert not path.exists()
        [partial] = tmp_path.iterdir()
        assert partial.name.startswith(".file.") and partial.suffix == ".partial"
    assert path.read_bytes() == b"half"


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(DataError, match=f"Cannot write {tmp_path / 'file' / 'below'}: "):
        write_atomically(tmp_path / "file" / "below", b"")
    (tmp_path / "folder").mkdir()
    with pytest.raises(DataError, match=f"Cannot write {tmp_path / 'folder'}: "):
        write_atomically(tmp_path / "folder", b"")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file", "folder"]


def test_the_hash_is_sha256_of_the_content(tmp_path: Path) -> None:
    write_atomically(tmp_path / "file", b"content")
    assert file_hash(tmp_path / "file") == hashlib.sha256(b"content").hexdigest()
    with pytest.raises(DataError, match=f"Cannot read {tmp_path / 'gone'}: No such file"):
        file_hash(tmp_path / "gone")


def test_who_comes_second_to_a_folder_waits_for_the_first(tmp_path, capfd):
    entered = threading.Event()

    def second():
        with alone_in(tmp_path):
            entered.set()

    thread = threading.Thread(target=second)
    with alone_in(tmp_path):
        thread.start()
        assert not entered.wait(0.2)
    thread.join()
    assert entered.is_set()
    assert f"waiting for another process that works in {tmp_path}" in capfd.readouterr().err


def test_only_ordinary_files_are_read(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"1234")
    (tmp_path / "link").symlink_to(tmp_path / "file")
    (tmp_path / "device").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe")
    assert read_bounded(tmp_path / "file", 4) == read_bounded(tmp_path / "link", 4) == b"1234"
    for name, complaint in {"file": "more than 3 bytes", "device": "a pipe or a device", "pipe": "a pipe or"}.items():
        with pytest.raises(OSError, match=complaint):
            read_bounded(tmp_path / name, 3)
    with pytest.raises(IsADirectoryError):
        read_bounded(tmp_path, 4)
    with pytest.raises(DataError, match=r"pipe: it is a pipe or a device, and no file\."):
        file_hash(tmp_path / "pipe")


@pytest.mark.parametrize("content", [b"", b"{", b"[" * 10**6, b"NaN", b'{"a": -Infinity}', b"\xff\xfe", b"9" * 10**5])
def test_what_is_no_json_is_refused(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(content)
    with pytest.raises(DataError, match="is not JSON"):
        read_json(tmp_path / "file")


def test_a_large_json_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"[1]" + b" " * 100)
    with pytest.raises(DataError, match="cannot be read: it has more than 50 bytes"):
        read_json(tmp_path / "file", 50)
