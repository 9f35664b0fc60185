import os
import pickle
import subprocess
import sys
import zipfile
from collections import OrderedDict
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from twbal.core.errors import CheckpointError
from twbal.core.files import file_hash
from twbal.core.gaussian import Gaussian
from twbal.io.checkpoint import load_checkpoint, save_checkpoint


def payload() -> dict[str, Any]:
    rng = np.random.default_rng(0)
    return {
        "centres": rng.standard_normal((4, 3)),
        "strided": rng.standard_normal((4, 6)).T[::-2],
        "scalar": np.array(2.5),
        "empty": np.empty((0, 3)),
        "indices": np.arange(3),
        "mask": np.array([True, False]),
        "odd": np.array([-0.0, np.inf, 5e-324]),
        "plain": {"text": "N·m", "whole": 2**40, "real": 0.1 + 0.2, "yes": True, "nothing": None},
        "nested": [(1, 2.0), [], (), {"again": ["x", {"deep": np.ones(2)}]}],
    }


def assert_equal(found: Any, expected: Any) -> None:
    assert type(found) is type(expected)
    if isinstance(expected, np.ndarray):
        assert (found.dtype, found.shape) == (expected.dtype, expected.shape)
        assert found.tobytes() == expected.tobytes()
    elif isinstance(expected, dict):
        assert list(found) == list(expected)
        for key in expected:
            assert_equal(found[key], expected[key])
    elif isinstance(expected, (list, tuple)):
        assert len(found) == len(expected)
        for one, other in zip(found, expected, strict=True):
            assert_equal(one, other)
    else:
        assert found == expected


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "model.pt"


def test_a_payload_comes_back_with_its_types_and_every_bit(path: Path) -> None:
    digest = save_checkpoint(path, "model", payload())
    assert digest == file_hash(path)
    assert_equal(load_checkpoint(path, "model"), payload())


def test_tensors_and_numpy_scalars_come_back_as_arrays_and_plain_values(path: Path) -> None:
    large = torch.arange(10.0, dtype=torch.float64, requires_grad=True)
    save_checkpoint(
        path, "model", {"view": large[2:4], "real": np.float64(1.5), "whole": np.int64(3), "yes": np.bool_(1)}
    )
    expected = {"view": np.array([2.0, 3.0]), "real": 1.5, "whole": 3, "yes": True}
    assert_equal(load_checkpoint(path, "model"), expected)


def test_an_array_that_is_read_can_be_written_to(path: Path) -> None:
    save_checkpoint(path, "model", payload())
    load_checkpoint(path, "model")["centres"][0, 0] = 1.0


def test_the_same_content_gives_the_same_bytes_under_any_name_and_after_a_round_trip(tmp_path: Path) -> None:
    first = save_checkpoint(tmp_path / "a.pt", "model", payload())
    assert save_checkpoint(tmp_path / "folder" / "another name.pt", "model", payload()) == first
    assert save_checkpoint(tmp_path / "c.pt", "model", load_checkpoint(tmp_path / "a.pt", "model")) == first


def test_which_objects_are_shared_does_not_change_the_bytes(tmp_path: Path) -> None:
    text, array, pair = "ab", np.ones(2), (1, "x")
    shared = {"text": [text, text], "array": [array, array], "pair": [pair, pair]}
    apart = {"text": [text, "".join(["a", "b"])], "array": [np.ones(2), np.ones(2)], "pair": [(1, "x"), (1, "x"[:])]}
    digests = {save_checkpoint(tmp_path / "a.pt", "model", value) for value in (shared, apart)}
    assert len(digests) == 1


@pytest.mark.slow
def test_another_process_writes_the_same_bytes(tmp_path: Path) -> None:
    script = (
        "import sys; from pathlib import Path; sys.path.insert(0, sys.argv[1]); from test_checkpoint import payload; "
        "from twbal.io.checkpoint import save_checkpoint; print(save_checkpoint(Path(sys.argv[2]), 'model', payload()))"
    )
    here = save_checkpoint(tmp_path / "here.pt", "model", payload())
    command = [sys.executable, "-c", script, str(Path(__file__).parent), str(tmp_path / "there.pt")]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip() == here


class Kind(StrEnum):
    GP = "gp"


@pytest.mark.parametrize(
    ("value", "name"),
    [
        ({1, 2}, "set"),
        (Path("x"), "pathlib.PosixPath"),
        (b"x", "bytes"),
        ({1: 2}, "dict"),
        (Gaussian(np.zeros(1), np.eye(1)), "twbal.core.gaussian.Gaussian"),
        (np.array([None]), "numpy.ndarray of object"),
        (np.array([1 + 2j]), "numpy.ndarray of complex128"),
        (OrderedDict(a=1), "collections.OrderedDict"),
    ],
)
def test_what_needs_code_is_not_written(path: Path, value: object, name: str) -> None:
    with pytest.raises(
        CheckpointError, match=rf"checkpoint\['payload'\]\['a'\]\[1\] is a {name}, which .* cannot hold"
    ):
        save_checkpoint(path, "model", {"a": [0, value]})
    assert not path.exists()


def test_a_text_of_a_derived_type_is_written_as_plain_text(path: Path) -> None:
    save_checkpoint(path, "model", {"kind": Kind.GP})
    assert_equal(load_checkpoint(path, "model"), {"kind": "gp"})


def refused(path: Path, kind: str = "model") -> str:
    with pytest.raises(CheckpointError) as caught:
        load_checkpoint(path, kind)
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_another_kind_is_refused(path: Path) -> None:
    save_checkpoint(path, "policy", payload())
    assert "holds a 'policy', expected a 'model'" in refused(path)


def test_a_file_that_is_not_there_is_named(path: Path) -> None:
    assert "There is no checkpoint" in refused(path)
    assert "is a folder; expected is a checkpoint, such as best_policy.pt" in refused(path.parent)


def test_another_schema_version_is_refused(path: Path) -> None:
    torch.save({"format": "twbal checkpoint", "schema_version": 2, "kind": "model", "payload": {}}, path)
    assert "has schema version 2; this twbal reads version 1" in refused(path)


class Anything:
    """A class that a checkpoint may not name."""


def test_a_checkpoint_that_needs_code_to_load_is_refused_and_not_run(path: Path) -> None:
    class Trap:
        def __reduce__(self) -> tuple[Any, ...]:
            return path.with_name("trapped").touch, ()

    content = {"format": "twbal checkpoint", "schema_version": 1, "kind": "model"}
    torch.save({**content, "payload": {"x": Anything()}}, path)
    assert "test_checkpoint.Anything) and is refused" in refused(path)
    torch.save({**content, "payload": {"x": Trap()}}, path)
    assert "needs code to load" in refused(path)
    path.write_bytes(pickle.dumps(Trap()))
    assert "is a bare pickle, which needs code to load and is refused" in refused(path)
    assert not path.with_name("trapped").exists()


def test_a_torch_file_of_others_is_refused(path: Path) -> None:
    torch.save({"weight": torch.zeros(2)}, path)
    assert "is a torch file, but not a checkpoint of twbal (it holds a dict)" in refused(path)
    torch.save({"format": "twbal checkpoint", "schema_version": 1, "kind": "model", "payload": OrderedDict()}, path)
    assert "holds a collections.OrderedDict" in refused(path)
    torch.save({"format": "twbal checkpoint", "schema_version": 1, "kind": "model"}, path)
    assert "has no payload" in refused(path)


def test_what_is_no_torch_file_is_refused(path: Path) -> None:
    path.write_text("tilt, tilt_rate")
    assert "is not a checkpoint (it begins with b'tilt, ti')" in refused(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "no tensors here")
    assert "is a zip file, but not a checkpoint" in refused(path)


def test_a_checkpoint_cut_anywhere_is_refused(path: Path) -> None:
    save_checkpoint(path, "model", payload())
    data = path.read_bytes()
    for length in {*range(0, len(data), 37), *range(len(data) - 80, len(data))}:
        path.write_bytes(data[:length])
        assert "is cut" in refused(path)


def test_a_damaged_checkpoint_is_refused_or_reads_the_same(path: Path) -> None:
    save_checkpoint(path, "model", payload())
    data, rng = path.read_bytes(), np.random.default_rng(0)
    refusals = 0
    for _ in range(400):
        damaged = bytearray(data)
        damaged[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
        path.write_bytes(bytes(damaged))
        try:
            found = load_checkpoint(path, "model")
        except CheckpointError:
            refusals += 1
        else:
            assert_equal(found, payload())  # the bit lay in padding
    assert refusals > 100


HEAD = {"format": "twbal checkpoint", "schema_version": 1, "kind": "model"}


def repeated(times: int) -> list[Any]:
    """A list of 2^times numbers that a few bytes describe."""
    values: list[Any] = [1.0]
    for _ in range(times):
        values = [values, values]
    return values


def endless() -> list[Any]:
    """A list that contains itself."""
    values: list[Any] = []
    values.append(values)
    return values


@pytest.mark.parametrize(
    "value",
    [
        repeated(12),
        repeated(40),
        endless(),
        {"a": endless()},
        torch.zeros(1).expand(2**40),
    ],
    ids=["many", "very many", "endless", "endless within", "expanded"],
)
def test_what_few_bytes_make_much_of_is_refused(path: Path, value: object) -> None:
    torch.save({**HEAD, "payload": {"x": value}}, path)
    assert "can: values that repeat, or contain themselves" in refused(path)


def test_a_tensor_without_values_is_refused(path: Path) -> None:
    torch.save({**HEAD, "payload": {"x": torch.zeros(9, device="meta")}}, path)
    assert "a tensor that numpy cannot hold" in refused(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({**HEAD, "payload": {1: 2}}, "holds a dict. It can hold: dict (with text keys)"),
        ({**HEAD, "payload": {"x": torch.zeros(2, dtype=torch.complex64)}}, "numpy.ndarray of complex64"),
        ({**HEAD, "payload": {"x": torch.zeros(2, dtype=torch.bfloat16)}}, "numpy cannot hold"),
        ({**HEAD, "schema_version": torch.tensor([1, 1])}, "has schema version tensor"),
        ({**HEAD, "schema_version": True}, "has schema version True"),
        ({**HEAD, "kind": ["model"]}, "expected a 'model'"),
        ({**HEAD, "format": torch.zeros(2)}, "is a torch file, but not a checkpoint of twbal"),
    ],
)
def test_content_of_odd_kinds_is_refused(path: Path, content: dict[str, Any], message: str) -> None:
    torch.save({"payload": {}, **content}, path)
    assert message in refused(path)


def test_a_compressed_checkpoint_is_refused_before_it_is_unfolded(path: Path) -> None:
    torch.save({**HEAD, "payload": {"x": torch.zeros(2**20)}}, path)
    plain = {}
    with zipfile.ZipFile(path) as archive:
        plain = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in plain.items():
            archive.writestr(name, data)
    assert path.stat().st_size < 2**16
    assert "a checkpoint of twbal is not compressed" in refused(path)


def test_a_pipe_is_refused_and_not_waited_for(path: Path) -> None:
    os.mkfifo(path)
    assert "it is a pipe or a device, and no file" in refused(path)


def test_importing_the_module_does_not_import_torch() -> None:
    script = "import sys, twbal.io.checkpoint; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
