"""Numbers from a file that `torch.save` wrote, without torch, which takes over a second and 180 MB to load."""

import math
import pickle
import zipfile
from collections import OrderedDict
from collections.abc import Sequence
from io import BytesIO
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

_TYPES = {
    "DoubleStorage": "<f8", "FloatStorage": "<f4", "HalfStorage": "<f2", "LongStorage": "<i8", "IntStorage": "<i4",
    "ShortStorage": "<i2", "CharStorage": "i1", "ByteStorage": "u1", "BoolStorage": "?",
}  # fmt: skip
# With these torch writes dicts, lists, tuples, plain values and tensors. They call only what `find_class` gives.
_OPCODES = (
    pickle.PROTO + pickle.STOP + pickle.MARK + pickle.EMPTY_DICT + pickle.SETITEM + pickle.SETITEMS + pickle.EMPTY_LIST
    + pickle.APPEND + pickle.APPENDS + pickle.EMPTY_TUPLE + pickle.TUPLE + pickle.TUPLE1 + pickle.TUPLE2 + pickle.TUPLE3
    + pickle.BINUNICODE + pickle.BININT + pickle.BININT1 + pickle.BININT2 + pickle.LONG1 + pickle.BINFLOAT + pickle.NONE
    + pickle.NEWTRUE + pickle.NEWFALSE + pickle.BINPUT + pickle.LONG_BINPUT + pickle.BINGET + pickle.LONG_BINGET
    + pickle.GLOBAL + pickle.BINPERSID + pickle.REDUCE
)  # fmt: skip


def read_plain(data: bytes) -> Any:
    """The content of a file of `torch.save`, with each tensor as a numpy array that can be written to.

    Args:
        data: of the whole file.

    Raises:
        Exception: of any kind, where it holds anything but dicts, lists, tuples, plain values and contiguous tensors of
            real numbers in the processor's memory.
    """
    with zipfile.ZipFile(BytesIO(data)) as archive:
        (root,) = [name.removesuffix("data.pkl") for name in archive.namelist() if name.endswith("/data.pkl")]
        if archive.read(f"{root}byteorder") != b"little":
            raise ValueError("its numbers are not little-endian")
        return _Reader(archive, root).load()


# Python's own, as that in C makes room for as many objects as a damaged file names.
class _Reader(pickle._Unpickler):
    """Reads the content of an archive whose names all begin with `root`."""

    dispatch: ClassVar = {code: pickle._Unpickler.dispatch[code] for code in _OPCODES}

    def __init__(self, archive: zipfile.ZipFile, root: str) -> None:
        super().__init__(BytesIO(archive.read(f"{root}data.pkl")))
        self._archive, self._root = archive, root
        self._storages: dict[str, NDArray[Any]] = {}

    def find_class(self, module: str, name: str) -> Any:
        """What stands for one of the few names that torch writes."""
        return _TYPES[name] if module == "torch" else _CALLED[module, name]

    def persistent_load(self, pid: Any) -> NDArray[Any]:
        """The numbers of one or more tensors, (n,)."""
        kind, dtype, key, place, count = pid
        if (kind, place) != ("storage", "cpu"):
            raise ValueError(f"a {kind} on {place}")
        if key not in self._storages:
            self._storages[key] = np.frombuffer(bytearray(self._archive.read(f"{self._root}data/{key}")), dtype, count)
        return self._storages[key]


def _tensor(
    storage: NDArray[Any], offset: int, shape: Sequence[int], strides: Sequence[int], is_tracked: bool, hooks: object
) -> NDArray[Any]:
    """The numbers of a tensor, as torch's `_rebuild_tensor_v2` takes them."""
    size = math.prod(shape)
    if size and strides != tuple(math.prod(shape[i:]) for i in range(1, len(shape) + 1)):
        raise ValueError(f"a tensor of {shape} with strides {strides}")
    return storage[offset : offset + size].reshape(shape)


_CALLED = {("torch._utils", "_rebuild_tensor_v2"): _tensor, ("collections", "OrderedDict"): OrderedDict}
