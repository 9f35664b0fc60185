"""Kernels that numba compiles, and where it keeps their machine code.

Numba's own cache knows a kernel by its file alone: one that was compiled into a kernel of another file is still used
after it was changed. So machine code is kept in a folder that is named after all kernels' sources together: any change
compiles anew. It lies in the person's cache folder, as the installed package may be read-only.
"""

import hashlib
import inspect
import os
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

# The kernels run as fast as with numba's usual 3, and compile in half of the time. Numba reads it when it is imported.
os.environ.setdefault("NUMBA_OPT", "2")

import llvmlite.binding
import llvmlite.ir
import numba
from numba.core import types
from numba.extending import get_cython_function_address, intrinsic, overload
from numba.np.unsafe.ndarray import to_fixed_tuple

from twbal.core.errors import ConfigError

Kernel = TypeVar("Kernel", bound=Callable[..., Any])
Numbers = TypeVar("Numbers")

_NUMBER = types.float64
_PACKAGE = Path(__file__).parents[1]
_MARK = b"twbal.core.compiled"  # in the source of all that is compiled, but for effects, of which any part may be
_EFFECTS = _PACKAGE / "effects"


def kernel(
    fastmath: bool | set[str] = False, is_kept: bool = True, is_inlined: bool = False
) -> Callable[[Kernel], Kernel]:
    """Compile the decorated function on its first call, and keep the machine code for later runs.

    Args:
        fastmath: liberties that the compiler may take with floating point, as numba's `fastmath`. None that changes a
            digit: what the compiler makes of it depends on what else it compiles, and code that was just compiled would
            give other digits than the same code from the cache.
        is_kept: False for what is only ever a part of other kernels, in whose machine code it is kept.
        is_inlined: True for a small part of a loop: its machine code is put wherever it is called. Calls pass each
            number of a named tuple by itself, and so cost more than the arithmetic between them. Larger code compiles
            slowly: the time grows with the number of places.
    """
    compiled = numba.njit(cache=is_kept, nogil=True, error_model="numpy", fastmath=fastmath, forceinline=is_inlined)
    return cast(Callable[[Kernel], Kernel], compiled)


def _fused(typing: Any, left: Any, right: Any, addend: Any) -> Any:
    return _NUMBER(_NUMBER, _NUMBER, _NUMBER), lambda context, builder, signature, values: builder.fma(*values)


fused = cast(Callable[[Any, Any, Any], Any], intrinsic(_fused))
"""left · right + addend of numbers, rounded once; for kernels.

Twice as fast as the two operations, and the same digits whatever the compiler makes of the code around it.
"""

ROUNDING = 6755399441055744.0
"""1.5 · 2^52: (z + ROUNDING) - ROUNDING is z, rounded to a whole number, for |z| < 2^51."""


def _times_power(typing: Any, value: Any, shifted: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        bits, power = (builder.bitcast(each, llvmlite.ir.IntType(64)) for each in values)
        moved = builder.shl(power, llvmlite.ir.Constant(llvmlite.ir.IntType(64), 52))
        return builder.bitcast(builder.add(bits, moved), llvmlite.ir.DoubleType())

    return _NUMBER(_NUMBER, _NUMBER), generate


times_power = cast(Callable[[Any, Any], Any], intrinsic(_times_power))
"""value · 2^k of a value and k + `ROUNDING`, where neither value nor result is 0 or subnormal; for kernels.

The last bits of k + `ROUNDING` are those of k, and are added to the exponent of the value.
"""


def _rarely(typing: Any, condition: Any) -> Any:
    boolean = llvmlite.ir.IntType(1)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        expect = builder.module.declare_intrinsic(
            "llvm.expect.i1", (), llvmlite.ir.FunctionType(boolean, [boolean, boolean])
        )
        return builder.call(expect, [*values, llvmlite.ir.Constant(boolean, 0)])

    return types.boolean(types.boolean), generate


rarely = cast(Callable[[Any], bool], intrinsic(_rarely))
"""A condition that hardly ever holds, for kernels: what is done then is put out of the way of what is always done."""


def specialised(choose: Callable[..., Callable[..., Any]]) -> Callable[[Kernel], Kernel]:
    """The decorated function, which kernels alone may call, has another body for each class of its first argument.

    Args:
        choose: given numba's types of the arguments, of which the first is one of named tuples, returns a function of
            the same arguments, which is compiled.
    """

    def decorate(function: Kernel) -> Kernel:
        def body(first: Any, *others: Any) -> Callable[..., Any]:
            chosen = choose(first, *others)
            chosen.__annotations__ = {}
            return chosen

        names = inspect.signature(function).parameters.values()
        bare = [name.replace(annotation=inspect.Parameter.empty) for name in names]  # as numba compares them
        body.__signature__ = inspect.Signature(bare)  # type: ignore[attr-defined]
        overload(function)(body)
        return function

    return decorate


def _from_row(like: Any, row: Any) -> Callable[..., Any]:
    kind, length = like.instance_class, len(like.instance_class._fields)
    return lambda like, row: kind(*to_fixed_tuple(row, length))  # type: ignore[call-arg]  # one is numba's own


@specialised(_from_row)
def of_row(like: Numbers, row: Any) -> Numbers:
    """A named tuple of numbers of the class of another one, from a row that has them; for kernels."""
    raise NotImplementedError


def foreign_function(name: str, library: Path, pointers: int) -> Callable[..., None]:
    """A C function that kernels, and they alone, may call: it takes addresses as integers and returns nothing.

    The machine code of its callers knows it by its name, so that it is kept for later runs.

    Args:
        name: of the function.
        library: file of the shared library that has it.
        pointers: how many it takes.

    Raises:
        OSError: the library cannot be loaded or has no such function.
    """
    try:
        llvmlite.binding.load_library_permanently(str(library))
    except RuntimeError as error:
        raise OSError(f"{library} cannot be loaded: {error}") from error
    if llvmlite.binding.address_of_symbol(name) is None:
        raise OSError(f"{library} has no function {name}. Is it another version?")
    return cast(Callable[..., None], types.ExternalFunction(name, types.void(*[types.uintp] * pointers)))


def address_in_scipy(module: str, name: str) -> int:
    """Address of a C function that a module of scipy has for compiled code.

    Args:
        module: in scipy, dotted.
        name: of the function.
    """
    return int(get_cython_function_address(f"scipy.{module}", name))


def method_kernel(kind: type, name: str, types: tuple[Any, ...], gives: type) -> Callable[..., Any]:
    """A method of a class that anybody may write, as a part of kernels.

    It is compiled by itself first, so that what numba says is about the method and not about the kernels around it.

    Args:
        kind: class of which it is a method.
        name: of the method.
        types: numba's types of `self` and of the other arguments.
        gives: what it must return: float or a class of named tuples.

    Raises:
        ConfigError: numba cannot compile it, or it returns something else.
    """
    part: Any = kernel(is_kept=False, is_inlined=True)(getattr(kind, name))
    try:
        part.compile(types)
    except Exception as error:  # numba lets errors of many classes through, all of them about this method
        raise _not_compiled(kind, name, _gist(str(error))) from error
    found = part.overloads[types].signature.return_type
    fits = isinstance(found, numba.types.Number) if gives is float else _named_tuple(found) is gives
    if not fits:
        raise _not_compiled(kind, name, f"it returns {found}, expected {gives.__name__}")
    return cast(Callable[..., Any], part)


def type_of(value: Any) -> Any:
    """Numba's type of a value."""
    return numba.typeof(value)  # type: ignore[no-untyped-call]


def _named_tuple(found: Any) -> type | None:
    return getattr(found, "instance_class", None)


def _not_compiled(kind: type, name: str, why: str) -> ConfigError:
    code = getattr(kind, name).__code__
    return ConfigError(
        f"Method {name!r} of {kind.__name__} ({code.co_filename}, line {code.co_firstlineno}) cannot be compiled: "
        f"{why}. Such a method uses numbers, math, numpy and what it is given."
    )


def _gist(message: str) -> str:
    """What numba says of a function, without where it met that and what it tried."""
    lines = (line.strip() for line in message.splitlines())
    said = [line for line in lines if line and not line.startswith("Failed in nopython mode")]
    end = next((i for i, line in enumerate(said) if line.startswith(("There are ", "During: ", "File "))), len(said))
    return " ".join(said[:end]).removesuffix(".")


def cache_folder() -> Path:
    """Where machine code of these very sources is kept; made if it is not there."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(_PACKAGE.rglob("*.py")):
        source = path.read_bytes()
        if _MARK in source or path.parent == _EFFECTS:
            digest.update(source)
    name = f"kernels-{digest.hexdigest()[:16]}"
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "twbal" / name
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass  # a home that cannot be written to: the system's place for temporary files serves
    folder = _temporary_folder() / name
    folder.mkdir(exist_ok=True)
    return folder


def _temporary_folder() -> Path:
    """A folder for temporary files that nobody else can write to: what lies in it is run as machine code."""
    folder = Path(tempfile.gettempdir()) / f"twbal-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022:
            return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="twbal-"))  # somebody else has made it: compiled anew in each process


if "NUMBA_CACHE_DIR" not in os.environ:
    numba.config.CACHE_DIR = str(cache_folder())  # type: ignore[attr-defined]
