"""Write the firmware's header of the messages, and their listing in docs/protocol.md: `python scripts/protocol.py`."""

import re
import textwrap
from collections.abc import Iterable
from enum import IntEnum, IntFlag
from pathlib import Path

from twbal.link.frame import MAX_FRAME
from twbal.link.message import MAX_TEXT, TEXT, Message
from twbal.link.protocol import (
    ON_BOARD_WATCHDOG,
    OWN,
    SHARED,
    VERSION,
    WATCHDOG,
    Clock,
    Drive,
    Sensors,
    Status,
    Welcome,
)

ROOT = Path(__file__).resolve().parent.parent
HEADER = ROOT / "firmware" / "include" / "twbal" / "protocol_messages.h"
PAGE = ROOT / "docs" / "protocol.md"
MARKS = "<!-- messages: written by scripts/protocol.py -->\n", "<!-- end of messages -->\n"
MESSAGES = sorted((*SHARED, *OWN), key=lambda kind: kind.TYPE)
ENUMS: tuple[type[IntEnum | IntFlag], ...] = (Clock, Drive, Status, Sensors)
TOP = """/* Messages of twbal's robot link, version {version}; docs/protocol.md says what they mean.
 *
 * Written by scripts/protocol.py.
 * C99 and C++11. Structures are packed and little-endian, as the machines are that this is for; floats are IEEE 754
 * binary32. A `name` or `text` of {max_text} bytes at most follows the last field, and ends with the payload.
 */
#ifndef TWBAL_PROTOCOL_MESSAGES_H
#define TWBAL_PROTOCOL_MESSAGES_H

#include <stdint.h>

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "twbal's messages are little-endian"
#endif

"""
CHECKS = """#ifdef __cplusplus
#define TWBAL_ASSERT_SIZE(type, size) static_assert(sizeof(type) == size, "padding in " #type)
#else
#define TWBAL_ASSERT_SIZE(type, size) typedef char type##_has_its_size[sizeof(type) == size ? 1 : -1]
#endif
"""


def header() -> str:
    """The header."""
    types = "".join(f"#define {constant(kind)} 0x{kind.TYPE:02x}u\n" for kind in MESSAGES)
    structs = "\n".join(struct(kind) for kind in MESSAGES)
    sizes = "".join(f"TWBAL_ASSERT_SIZE(twbal_{snake(kind)}, {kind.PACKING.size});\n" for kind in MESSAGES)
    packed = f"#pragma pack(push, 1)\n\n{structs}\n#pragma pack(pop)\n"
    top = TOP.format(version=VERSION, max_text=MAX_TEXT)
    return "\n".join([top + numbers(), types, *map(enum, ENUMS), packed, f"{CHECKS}{sizes}\n#endif\n"])


def numbers() -> str:
    """Constants of the protocol."""
    values = {
        "PROTOCOL_VERSION": f"{VERSION}u",
        "MAX_FRAME": f"{MAX_FRAME}u /* bytes between two zeros */",
        "MAX_TEXT": f"{MAX_TEXT}u /* bytes */",
        "WATCHDOG_US": f"{round(WATCHDOG * 1e6)}u",
        "ON_BOARD_WATCHDOG_US": f"{round(ON_BOARD_WATCHDOG * 1e6)}u",
    }
    return "".join(f"#define TWBAL_{name} {value}\n" for name, value in values.items())


def enum(kind: type[IntEnum | IntFlag]) -> str:
    """The values of an enumeration; of bits without those that have no name."""
    names = "".join(f"#define TWBAL_{kind.__name__.upper()}_{member.name} {member.value}u\n" for member in kind)
    return f"/* {doc(kind)} */\n{names}"


def struct(kind: type[Message]) -> str:
    """The structure of a message."""
    rows = [("uint8_t", "type", f"0x{kind.TYPE:02x}")]
    rows += [(field.wire.c_type, field.name, field.meaning) for field in kind.LAYOUT if field.wire is not TEXT]
    text = [f"    /* char {field.name}[]: {field.meaning} */" for field in kind.LAYOUT if field.wire is TEXT]
    fields = [f"    {of} {name};".ljust(36) + f" /* {meaning} */" for of, name, meaning in rows]
    return "\n".join([f"/* {doc(kind)} */", "typedef struct {", *fields, *text, f"}} twbal_{snake(kind)};", ""])


def doc(kind: type) -> str:
    """The first line of what a class says of itself."""
    return str(kind.__doc__).splitlines()[0].replace("`", "")


def snake(kind: type) -> str:
    """`PoseReport` as pose_report."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower()


def constant(kind: type[Message]) -> str:
    """Name of a message's type."""
    return f"TWBAL_TYPE_{snake(kind).upper()}"


def tables() -> str:
    """The messages and enumerations as the specification shows them."""
    return "\n".join([*map(message_table, MESSAGES), *map(enum_table, ENUMS)])


def message_table(kind: type[Message]) -> str:
    """One message: its fields with offset and type."""
    rows, at = ["| 0 | `type` | uint8_t | " + f"0x{kind.TYPE:02x} |"], 1
    for field in kind.LAYOUT:
        length = len(field.wire.code) and {"B": 1, "H": 2, "I": 4, "f": 4}[field.wire.code]
        of = field.wire.c_type if length else "UTF-8"
        rows.append(f"| {at} | `{field.name}` | {of} | {field.meaning} |")
        at += length
    first_fields = " Type, `seq` and `version` never change." if kind is Welcome else ""
    size = f"{kind.PACKING.size} bytes" + (" and a text" if kind.LAYOUT[-1].wire is TEXT else "")
    said = textwrap.fill(f"{doc(kind)} {size}.{first_fields}", 118, break_on_hyphens=False)
    head = [f"### {kind.__name__}", "", said, "", "| at | field | type | meaning |"]
    return "\n".join([*head, "|---|---|---|---|", *rows, ""])


def enum_table(kind: type[IntEnum | IntFlag]) -> str:
    """One enumeration."""
    listed: Iterable[str] = (f"`{member.name}` {member.value}" for member in kind)
    return textwrap.fill(f"**{kind.__name__}**: {', '.join(listed)}.", 118, break_on_hyphens=False) + "\n"


def page() -> str:
    """The specification with its listing of messages written anew."""
    begin, end = MARKS
    before, _, rest = PAGE.read_text().partition(begin)
    return f"{before}{begin}\n{tables()}\n{end}{rest.partition(end)[2]}"


if __name__ == "__main__":
    HEADER.write_text(header())
    PAGE.write_text(page())
