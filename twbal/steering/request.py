"""What a person asks a robot for by keys or sticks, over time."""

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from twbal.core.episode import Event

TURN_TIME = 0.5
"""A turn ends this long after the last key for it, or as long as keys count [s]: a terminal does not tell of a key that
is let go."""
_MOVED = 0.05  # share of a stick's way: less is the unrest of a hand, or of the pad
_NONE = 1e-9  # of a share


class Key(Enum):
    """What a key or a button asks for."""

    FASTER = "faster"
    SLOWER = "slower"
    LEFT = "left"
    RIGHT = "right"
    KEEP = "keep"
    REST = "rest"
    END = "end"
    STOP = "stop"


_MOVES = (Key.FASTER, Key.SLOWER, Key.LEFT, Key.RIGHT)


class Sticks(NamedTuple):
    """Where the sticks of a gamepad stand.

    Attributes:
        speed: share of the speed limit, -1 to 1, forward being positive.
        turn: share of the yaw rate's limit, -1 to 1, left being positive.
    """

    speed: float
    turn: float


class SteeringRequest(NamedTuple):
    """What is asked for.

    Attributes:
        speed: share of the speed limit, forward being positive.
        turn: share of the yaw rate's limit, left being positive.
    """

    speed: float = 0.0
    turn: float = 0.0


@dataclass(frozen=True)
class Response:
    """How keys are answered.

    Attributes:
        speed_step: by which a key changes the asked speed, as a share of its limit.
        turn: yaw rate that a key asks for, as a share of its limit.
        input_timeout: time without a key after which nothing is asked for any more [s].
        hold: the asked speed stays where no key comes.
        stick_timeout: time without an event of a gamepad after which its sticks ask for nothing any more [s].
    """

    speed_step: float
    turn: float
    input_timeout: float
    hold: bool
    stick_timeout: float


class Steering:
    """Follows the keys and sticks of one drive.

    A key is only said to be pressed, and a stick to be moved: one that is held still is as silent as a gamepad that is
    out of range. So silence ends what is asked for, of sticks later than of keys. From then on, and after a key for
    rest, a stick asks for something once it has itself been moved, or was in its middle.

    Args:
        response: how keys are answered.

    Attributes:
        asked: now.
        ending: why the drive comes to rest and ends; empty while it does not.
        stopped: why the motors are to be switched off at once; empty while they are not.
        events: what was more than a key, with times.
    """

    def __init__(self, response: Response) -> None:
        self.asked = SteeringRequest()
        self.ending = self.stopped = ""
        self.events: list[Event] = []
        self._response = response
        self._by_sticks = False
        self._sticks = Sticks(0.0, 0.0)  # where they stand
        self._passed_over: dict[str, float] = {}  # sticks that do not count until they are moved, and where from
        self._heard = self._turned = 0.0  # times of the last input, and of the last for a turn [s]

    def take(self, time: float, what: Key | Sticks) -> None:
        """Take a key, or where the sticks stand, at a time [s] since the drive began."""
        if what is Key.STOP:
            self.stopped = self.stopped or "stopped by a key"
        if self.stopped or self.ending:
            return
        self._heard = time
        if isinstance(what, Sticks) or what in _MOVES:
            self._by_sticks = isinstance(what, Sticks)
        if what is Key.END:
            self.end(time, "ended by a key")
        elif isinstance(what, Sticks):
            self._sticks = what
            self.asked = SteeringRequest(self._counted("speed", what.speed), self._counted("turn", what.turn))
        elif what is Key.KEEP:
            self._turned = time
        else:
            self._press(time, what)

    def pass_over(self, sticks: Sticks) -> None:
        """Take it that the sticks stand so, and that each counts once it is moved."""
        self._sticks = sticks
        self._passed_over = {name: share for name, share in sticks._asdict().items() if share}

    def end(self, time: float, why: str) -> None:
        """Ask for nothing any more, and have the drive end once the reference is at rest."""
        if not self.ending:
            self.asked, self.ending = SteeringRequest(), why
            self.events.append(Event(time, f"{why}: the reference goes to rest"))

    def wait(self, time: float) -> None:
        """Notice at a time [s] what has not come."""
        if self._by_sticks:
            self._expire(time, self._response.stick_timeout, "no event of the gamepad")
            return
        if time - self._turned > max(TURN_TIME, self._response.input_timeout):
            self.asked = self.asked._replace(turn=0.0)
        if not self._response.hold:
            self._expire(time, self._response.input_timeout, "no key")

    def _expire(self, time: float, silence: float, what: str) -> None:
        """Ask for nothing any more where nothing came for so long [s]."""
        if self.asked != SteeringRequest() and time - self._heard > silence:
            self.asked = SteeringRequest()
            self.pass_over(self._sticks)
            self.events.append(Event(time, f"{what} for {silence:g} s: the reference goes to rest"))

    def _counted(self, name: str, share: float) -> float:
        """What a stick asks for: nothing while it stands where it was passed over."""
        before = self._passed_over.get(name)
        if before is not None and share and abs(share - before) <= _MOVED:
            return 0.0
        self._passed_over.pop(name, None)
        return _within_one(share)

    def _press(self, time: float, key: Key) -> None:
        speed, turn = self.asked
        if key in (Key.FASTER, Key.SLOWER):
            speed += self._response.speed_step * (1 if key is Key.FASTER else -1)
        elif key in (Key.LEFT, Key.RIGHT):
            turn, self._turned = self._response.turn * (1 if key is Key.LEFT else -1), time
        else:
            speed = turn = 0.0
            self.pass_over(self._sticks)
        self.asked = SteeringRequest(0.0 if abs(speed) < _NONE else _within_one(speed), turn)


def _within_one(share: float) -> float:
    return min(max(share, -1.0), 1.0)
