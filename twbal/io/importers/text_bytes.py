"""The bytes of a text file as text: UTF-8, UTF-16 or Latin-1, also where some of them are zero."""

import codecs
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from twbal.core.errors import LogError
from twbal.core.text import counted
from twbal.io.importers.formats import readable

_FEW = 0.02  # share of the other bytes up to which zero bytes are damage, and the rest is text
_LOOKED_AT = 1 << 16  # bytes by which it is told whether every second one is zero
_EVERY_SECOND = 0.9  # share of the bytes in every second place that are zero, from which on a text is in UTF-16
_WITHIN = re.compile(r"(?<=[^\s,;|\0])\0+(?=[^\s,;|\0])")  # zero bytes with something of a field on both sides
_BESIDE = re.compile(r"(?<=[\d.])\0+|\0+(?=[\d.+-])")  # and those that may stand for digits at a number's end
_SELDOM = 0.01  # of such a line, up to which they are damage; else a program writes the ends of its strings, too
_DAMAGED = "\N{REPLACEMENT CHARACTER}"


class Decoded(NamedTuple):
    """A text, and what was odd about its bytes."""

    text: str
    notes: tuple[str, ...] = ()


def decoded(path: Path, data: bytes) -> Decoded:
    """A file's bytes as text, in UTF-8, UTF-16 or else Latin-1, which any bytes are.

    Zero bytes at the end are left out, and so are few among the text. Those that may have taken digits of a number
    become a character that is in no number, so that it is not read as another one.

    Raises:
        LogError: it is no text, by its zero bytes, or text in UTF-16 that breaks off.
    """
    notes: list[str] = []
    order = "utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else _order(data)
    try:
        text = data.decode(order) if order else _of_bytes(data)
    except UnicodeDecodeError as error:
        begins = "begins as text in UTF-16" if order == "utf-16" else f"seems to be text in {order.upper()}"
        raise LogError(f"{path} {begins}, and breaks off or is none: {error}.") from error
    if order not in ("", "utf-16"):
        notes.append("every second byte is zero: read as text in UTF-16 without its byte-order mark")
    if "\0" not in text:
        return Decoded(text, tuple(notes))
    width = 2 if order else 1  # bytes of a character
    whole = text.rstrip("\0")
    if not whole:
        raise LogError(
            f"{path} has nothing in it but {len(data)} zero bytes, as where the power goes before a file is closed."
        )
    if tail := width * (len(text) - len(whole)):
        notes.append(f"its last {f'{tail} bytes are' if tail > 1 else 'byte is'} zero: left out")
    if zeros := whole.count("\0"):
        if zeros > _FEW * (len(whole) - zeros):
            raise LogError(
                f"{path} is no text file ({width * zeros} of its {width * len(whole)} bytes are zero), whatever its "
                f"name says. {readable()}; an .mcap file of twbal's needs no import."
            )
        notes.append(f"{counted(width * zeros, 'zero byte')} among its text: left out")
        whole = _without_zeros(whole.lstrip("\0"))
    return Decoded(whole, tuple(notes))


def _without_zeros(text: str) -> str:
    """A text without its zero bytes, in which a number that may have lost digits to them is none."""
    if len(_BESIDE.findall(text)) <= _SELDOM * (text.count("\n") + 1):
        text = _BESIDE.sub(_DAMAGED, text)
    return _WITHIN.sub(_DAMAGED, text).replace("\0", "")


def _order(data: bytes) -> str:
    """The order of bytes of a text in UTF-16 without its mark, by which of two bytes is zero; "" of any other file."""
    sample = np.frombuffer(data[:_LOOKED_AT].rstrip(b"\0"), np.uint8) == 0
    if len(sample) < 2 or not sample.any():
        return ""
    first, second = float(sample[::2].mean()), float(sample[1::2].mean())
    if second >= _EVERY_SECOND and first <= _FEW:
        return "utf-16-le"
    return "utf-16-be" if first >= _EVERY_SECOND and second <= _FEW else ""


def _of_bytes(data: bytes) -> str:
    """Text in UTF-8, with or without a byte-order mark; else in Latin-1."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.removeprefix(codecs.BOM_UTF8).decode("latin-1")
