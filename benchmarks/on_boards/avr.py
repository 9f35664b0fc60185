"""What a header takes on the ATmega32U4: compiled by avr-gcc, and run in the simulator simavr (libsimavr)."""

import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

CALLS = 16
_SECONDS = 60.0  # for the simulator
_FLAGS = ("-std=c99", "-mmcu=atmega32u4", "-Os", "-lm")
_RUNNER = Path(__file__).parent / "run_on_avr.c"
_BOTH = "#include <avr/io.h>\n#include <avr/sleep.h>\n#include <avr/interrupt.h>\n"
_MAIN = """\
static volatile float sensed; /* what the compiler cannot know */
int main(void)
{
    static twbal_policy_memory memory;
    twbal_observation seen = {0, 0, 0, 0, 0, 0, 0};
    twbal_reference asked = {0, 0, 0};
    int n;
    twbal_policy_reset(&memory);
    for (n = 0; n < CALLS; ++n) {
        sensed = (float)n - 0.5f * CALLS;
        seen.duration = n ? TWBAL_POLICY_CONTROL_PERIOD : 0.0f;
        seen.tilt = 0.02f * sensed;
        seen.tilt_rate = -0.11f * sensed;
        seen.wheel_angle = 0.13f * sensed;
        seen.wheel_rate = 0.7f * sensed;
        seen.acceleration = 0.3f * sensed;
        GPIOR0 = 1;
        sensed = twbal_policy_step(&memory, &seen, &asked);
        GPIOR0 = 2;
    }
    cli();
    sleep_enable();
    sleep_cpu();
    return 0;
}
"""


class Taken(NamedTuple):
    """What a header takes.

    Attributes:
        flash: of a program with it, less that of the same program without [bytes].
        memory: of data that last, likewise [bytes].
        cycles: of a call of `twbal_policy_step`, the mean and the most of `CALLS` calls.
    """

    flash: int
    memory: int
    cycles: tuple[int, int]


def taken(header: Path) -> Taken:
    """Compile and run it.

    Raises:
        RuntimeError: the simulator does not say what it should.
    """
    with tempfile.TemporaryDirectory(prefix="twbal-avr-") as name:
        folder = Path(name)
        with_it = f'{_BOTH}#define CALLS {CALLS}\n#include "{header.absolute()}"\n{_MAIN}'
        program = _compiled(folder, "with", with_it)
        without = _compiled(folder, "without", f"{_BOTH}int main(void) {{ return 0; }}\n")
        sizes = [a - b for a, b in zip(_sizes(program), _sizes(without), strict=True)]
        return Taken(*sizes, _cycles(folder, program))


def _compiled(folder: Path, name: str, text: str) -> Path:
    source, program = folder / f"{name}.c", folder / f"{name}.elf"
    source.write_text(text)
    subprocess.run(["avr-gcc", str(source), "-o", str(program), *_FLAGS], check=True)
    return program


def _sizes(program: Path) -> tuple[int, int]:
    """Flash and memory [bytes]."""
    said = subprocess.run(["avr-size", str(program)], check=True, capture_output=True, text=True).stdout
    text, data, bss = map(int, said.splitlines()[1].split()[:3])
    return text + data, data + bss


def _cycles(folder: Path, program: Path) -> tuple[int, int]:
    runner = folder / "runner"
    subprocess.run(["gcc", "-O1", "-o", str(runner), str(_RUNNER), "-lsimavr", "-lelf"], check=True)
    said = subprocess.run([runner, program], capture_output=True, text=True, timeout=_SECONDS, check=True).stdout
    found = [int(line) for line in said.splitlines() if line.isdecimal()]
    if len(found) != CALLS:
        raise RuntimeError(f"the simulator says {said}")
    return round(sum(found) / CALLS), max(found)
