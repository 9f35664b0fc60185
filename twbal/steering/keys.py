"""From the bytes of a terminal to keys."""

from twbal.steering.request import Key

ESCAPE_TIME = 0.05
"""An escape after which nothing comes for so long is the key, and not the beginning of an arrow's bytes [s]."""
KEYS = {
    **dict.fromkeys("wW", Key.FASTER),
    **dict.fromkeys("sS", Key.SLOWER),
    **dict.fromkeys("aA", Key.LEFT),
    **dict.fromkeys("dD", Key.RIGHT),
    **dict.fromkeys("\r\n", Key.KEEP),
    " ": Key.REST,
    **dict.fromkeys("qQ", Key.END),
    **dict.fromkeys("xX", Key.STOP),
}
"""By character."""
ARROWS = {"A": Key.FASTER, "B": Key.SLOWER, "C": Key.RIGHT, "D": Key.LEFT}
"""By the last byte of ESC [ A or ESC O A (ECMA-48, and xterm's cursor keys)."""
_ESCAPE = "\x1b"


class KeyDecoder:
    """Makes keys of bytes, also where the bytes of an arrow come apart; keys that mean nothing are left out."""

    def __init__(self) -> None:
        self._begun = ""  # of a sequence that is not complete
        self._since = 0.0  # when it began [s]

    def feed(self, data: bytes, time: float) -> list[Key]:
        """The keys of what came by a time [s]; a lone escape is a stop, once it has stayed alone."""
        keys = [key for character in data.decode("latin-1") if (key := self._next(character, time)) is not None]
        if self._begun and time - self._since > ESCAPE_TIME:
            self._begun = ""
            keys.append(Key.STOP)
        return keys

    def _next(self, character: str, time: float) -> Key | None:
        if not self._begun:
            if character != _ESCAPE:
                return KEYS.get(character)
            self._begun, self._since = character, time
            return None
        if self._begun == _ESCAPE:
            if character in "[O":
                self._begun += character
                return None
            self._begun = ""
            return Key.STOP  # an escape, and another key
        if "@" <= character <= "~":  # the last byte of a sequence
            plain, self._begun = len(self._begun) == len("\x1b["), ""
            return ARROWS.get(character) if plain else None
        self._begun += character
        return None
