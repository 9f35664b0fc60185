"""What a policy takes on small boards: flash, memory and time. Estimates: nothing here was run on them."""

from dataclasses import dataclass

from twbal.embedded.law import Law, Operations
from twbal.embedded.laws import law_of
from twbal.policies.saved import SavedPolicy

_ASSEMBLY = Operations(add=28, multiply=11, divide=2, read=0)  # of the state, and of the cuts of its channels
_FLOAT = 4  # bytes
_CALLS = 64  # registers and return addresses on the stack [bytes]
_SHARE = 0.5  # of a control period, and of flash and memory, that the policy may take: the rest is the firmware's


@dataclass(frozen=True)
class Board:
    """A processor.

    Attributes:
        name: of it.
        clock: [Hz].
        flash: for programs [bytes].
        memory: [bytes].
        code: of the header without its constants, with the functions of the mathematical library [bytes].
        cycles: of each operation.
        source: where the numbers come from.
    """

    name: str
    clock: float
    flash: int
    memory: int
    code: int
    cycles: Operations
    source: str


BOARDS = (
    Board(
        name="ESP32",
        clock=240e6,
        flash=1_310_720,  # of the usual partition
        memory=327_680,
        code=6000,
        cycles=Operations(add=4, multiply=4, divide=170, read=3, exp=500, sin=1000, asin=800, tanh=1000),
        source="its floating-point unit adds and multiplies in a cycle, and loads and loops come to it; division and "
        "functions are software (guesses)",
    ),
    Board(
        name="ATmega32U4",
        clock=16e6,
        flash=28_672,  # 32 KiB less the bootloader
        memory=2560,
        code=3700,
        cycles=Operations(add=108, multiply=138, divide=465, read=12, exp=2765, sin=1653, asin=2556, tanh=3173),
        source="cycles of each function by the manual of avr-libc 2.0 (Benchmarks), code size by avr-gcc 5.4 -Os; five "
        "policies took -27 to +3 % fewer cycles in the simulator simavr than estimated so",
    ),
)


@dataclass(frozen=True)
class Need:
    """What a policy takes on a board.

    Attributes:
        board: its name.
        flash: constants and code [bytes].
        memory: what a rollout remembers, and the stack of a call [bytes].
        cycles: of a call.
        microseconds: of a call.
        fits: within half of the board's flash, memory and control period.
        lacks: what it takes too much of, in words; empty where it fits.
    """

    board: str
    flash: int
    memory: int
    cycles: int
    microseconds: float
    fits: bool
    lacks: str


def need_on(board: Board, policy: SavedPolicy, past: int, control_period: float) -> Need:
    """Estimate what a policy takes.

    Args:
        board: that it is for.
        policy: to be carried.
        past: commands that it remembers.
        control_period: [s].
    """
    law = law_of(policy)
    flash = board.code + _FLOAT * law.numbers
    width = len(policy.channels)
    memory = _FLOAT * (8 + past + 2 * width + law.scratch) + _CALLS
    cycles = _cycles(board, law, width)
    seconds = cycles / board.clock
    parts = {
        f"flash ({flash} of {board.flash} bytes)": flash > _SHARE * board.flash,
        f"memory ({memory} of {board.memory} bytes)": memory > _SHARE * board.memory,
        f"time ({1e3 * seconds:.1f} ms of a control period of {1e3 * control_period:g} ms)": seconds
        > _SHARE * control_period,
    }
    lacks = ", ".join(part for part, is_too_much in parts.items() if is_too_much)
    return Need(board.name, flash, memory, cycles, 1e6 * seconds, not lacks, lacks)


def _cycles(board: Board, law: Law, width: int) -> int:
    counts = [a + b for a, b in zip(law.operations, _ASSEMBLY, strict=True)]
    counts[0] += 2 * width
    return int(sum(count * cost for count, cost in zip(counts, board.cycles, strict=True)))
