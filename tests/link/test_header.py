"""The header for firmware says what the Python messages say."""

import runpy
import shutil
import struct
import subprocess
from pathlib import Path

import pytest

from twbal.link.message import TEXT
from twbal.link.protocol import OWN, SHARED, Clock, Drive, Sensors, Status

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = runpy.run_path(str(ROOT / "scripts" / "protocol.py"))
HEADER = SCRIPT["HEADER"]


def test_the_header_and_the_page_are_those_of_the_messages():
    assert HEADER.read_text() == SCRIPT["header"](), "Run `python scripts/protocol.py`."
    assert SCRIPT["PAGE"].read_text() == SCRIPT["page"](), "Run `python scripts/protocol.py`."


def program():
    """Prints sizes, offsets and constants as the compiler sees them, and a Command as it lies in memory."""
    lines = []
    for kind in (*SHARED, *OWN):
        name = f"twbal_{SCRIPT['snake'](kind)}"
        lines.append(f'printf("{kind.__name__} %zu\\n", sizeof({name}));')
        fixed = [field.name for field in kind.LAYOUT if field.wire is not TEXT]
        lines += [f'printf("{kind.__name__}.{f} %zu\\n", offsetof({name}, {f}));' for f in ("type", *fixed)]
        lines.append(f'printf("type {kind.__name__} %u\\n", (unsigned){SCRIPT["constant"](kind)});')
    for enum in (Clock, Drive, Status, Sensors):
        for member in enum:
            constant = f"TWBAL_{enum.__name__.upper()}_{member.name}"
            lines.append(f'printf("{enum.__name__}.{member.name} %u\\n", (unsigned){constant});')
    lines.append("twbal_command c; c.type = TWBAL_TYPE_COMMAND; c.seq = 258; c.total = -1.5f; c.difference = 0.25f;")
    lines.append('for (size_t k = 0; k < sizeof c; ++k) printf("byte %02x\\n", ((unsigned char *)&c)[k]);')
    body = "\n".join(lines)
    includes = "".join(f"#include <{name}>\n" for name in ("stddef.h", "stdio.h", "twbal/protocol_messages.h"))
    return f"{includes}int main(void) {{\n{body}\n}}\n"


def expected():
    """The same, by Python's own `struct`."""
    for kind in (*SHARED, *OWN):
        codes = "".join(field.wire.code for field in kind.LAYOUT)
        yield f"{kind.__name__} {struct.calcsize('<B' + codes)}"
        yield f"{kind.__name__}.type 0"
        for k, field in enumerate(field for field in kind.LAYOUT if field.wire is not TEXT):
            yield f"{kind.__name__}.{field.name} {struct.calcsize('<B' + codes[:k])}"
        yield f"type {kind.__name__} {kind.TYPE}"
    for enum in (Clock, Drive, Status, Sensors):
        yield from (f"{enum.__name__}.{member.name} {member.value}" for member in enum)
    yield from (f"byte {byte:02x}" for byte in struct.pack("<BHff", 0x06, 258, -1.5, 0.25))


@pytest.mark.skipif(shutil.which("g++") is None, reason="there is no g++")
@pytest.mark.parametrize(("language", "standard"), [("c++", "c++17"), ("c++", "c++11"), ("c", "c99")])
def test_a_compiler_lays_the_messages_out_as_python_does(language, standard, tmp_path):
    source = tmp_path / "layout.c"
    source.write_text(program())
    strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I", str(HEADER.parents[1])]
    binary = tmp_path / "layout"
    subprocess.run(["g++", "-x", language, f"-std={standard}", *strict, str(source), "-o", str(binary)], check=True)
    said = subprocess.run([str(binary)], check=True, capture_output=True, text=True).stdout
    assert said.splitlines() == list(expected())


def test_every_message_fits_into_a_frame_with_its_longest_text():
    longest = max(kind.PACKING.size for kind in (*SHARED, *OWN) if kind.LAYOUT[-1].wire is TEXT)
    assert longest + SCRIPT["MAX_TEXT"] + 2 + 2 <= SCRIPT["MAX_FRAME"]  # CRC, and what COBS adds up to 254 bytes
