"""Cycles and flash of a policy of each kind on the ATmega32U4, in simavr, beside the estimates.

    python -m benchmarks.on_boards

Results are in benchmarks/results/on_board_cycles.json. Needs avr-gcc, gcc, libsimavr and libelf (Debian: gcc-avr
avr-libc libsimavr-dev libelf-dev). `python -m benchmarks.on_boards.agreement` compares headers with their policies,
and `python -m benchmarks.on_boards.distilling` says what fewer basis functions cost.
"""

import json
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.on_boards.agreement import NAMES, paper
from benchmarks.on_boards.avr import taken
from benchmarks.on_boards.kinds_of_policies import POLICIES, exported
from benchmarks.settings import number_settings
from twbal.core.files import write_atomically
from twbal.embedded.boards import BOARDS, need_on
from twbal.embedded.header import header

RESULTS = Path("benchmarks/results/on_board_cycles.json")


def main(words: Sequence[str]) -> None:
    """Measure all kinds."""
    number_settings({}, words)
    results: dict[str, Any] = {}
    robot = paper()
    for name, policy in POLICIES.items():
        made = exported(policy, robot)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "policy.h"
            file.write_text(header(made))
            found = taken(file)
        needs = {b.name: need_on(b, policy, len(made.channels.lags), robot.control_period) for b in BOARDS}
        estimated = {board: {"flash": need.flash, "cycles": need.cycles} for board, need in needs.items()}
        results[name] = {"measured": found._asdict(), "estimated": estimated}
        print(name, results[name], flush=True)
    write_atomically(RESULTS, json.dumps(results, indent=1) + "\n")


def on_board_cycles(results: Mapping[str, Any]) -> list[str]:
    """One line a policy."""
    clocks = {board.name: board.clock for board in BOARDS}
    lines = [
        "| policy | ESP32, a call (guess) | ATmega32U4, a call (estimate) | in simavr (mean) | estimate off by | flash "
        "(estimate) | by avr-gcc |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, found in results.items():
        small, large, cycles = (
            found["estimated"]["ATmega32U4"],
            found["estimated"]["ESP32"],
            found["measured"]["cycles"][0],
        )
        lines.append(
            f"| {NAMES[name]} | {1e6 * large['cycles'] / clocks['ESP32']:.0f} µs "
            f"| {1e3 * small['cycles'] / clocks['ATmega32U4']:.2g} ms | {1e3 * cycles / clocks['ATmega32U4']:.2g} ms "
            f"| {100 * (small['cycles'] / cycles - 1):+.0f} % | {small['flash']:,} bytes "
            f"| {found['measured']['flash']:,} bytes |"
        )
    return lines


if __name__ == "__main__":
    main(sys.argv[1:])
