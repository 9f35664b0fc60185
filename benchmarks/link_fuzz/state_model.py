"""When a robot's motors may be on, and what they get: the rules of docs/protocol.md, apart from any firmware.

The robot is that of `firmware/tests/fake_board.h`: limits of 20 and 10 N·m, 20 ms, and a policy that gives twice the
tilt, the reference's place and 0.5 where that gives way, and the reference's speed as difference.
"""

import math

from twbal.link.decoder import Decoder
from twbal.link.message import Message
from twbal.link.protocol import Arm, Command, Drive, Follow, Hello, Stop

STRANGE, OFF, ARMED, TRIPPED = range(4)
PERIOD, WATCHDOG, ON_BOARD_WATCHDOG = 20_000, 100_000, 10_000_000  # µs
TILT_LIMIT, TOTAL, DIFFERENCE = 1.0, 20.0, 10.0
AT_REST, HERE = (0.0, 0.0), (0.0, 0.0, 0)


def cut(total: float, difference: float) -> tuple[float, float]:
    """What the wheels get of what is asked, balancing first."""
    total = min(max(total, -TOTAL), TOTAL)
    left = min(DIFFERENCE, TOTAL - abs(total))
    return total, min(max(difference, -left), left)


class StateModel:
    """A robot in real time, with a policy on board.

    Attributes:
        state: one of the four.
    """

    def __init__(self) -> None:
        self.state, self._taken, self._asked = STRANGE, 0, AT_REST
        self._decoder = Decoder(2)
        self._tilt = self._rate = 0.0
        self._tick = self._heard = 0
        self._drive, self._reference = Drive.TORQUE, HERE

    @property
    def output(self) -> tuple[float, float]:
        """What the motors get: sum and difference."""
        return self._asked if self.state == ARMED else AT_REST

    def sees(self, tilt: float, rate: float) -> None:
        """What its sensors say from now on."""
        self._tilt, self._rate = tilt, rate

    def port_closed(self) -> None:
        """No host has its port open."""
        self.state = STRANGE

    def receive(self, data: bytes, now: int) -> None:
        """Bytes come, after a wait while the loop was held at times."""
        self._watch(now)
        for message in self._decoder.feed(data):
            self._take(message, now)

    def run(self, now: int) -> None:
        """Time passes."""
        while self.state == ARMED and self._tick + PERIOD <= now:
            self._tick += PERIOD
            self._watch(self._tick)
            self._look()
        self._watch(now)

    def _watch(self, now: int) -> None:
        silence = now - self._heard
        if self.state != ARMED:
            return
        if self._drive is Drive.ON_BOARD and silence > WATCHDOG:
            self._reference = (self._reference[0], 0.0, self._reference[2])
        if silence > (ON_BOARD_WATCHDOG if self._drive is Drive.ON_BOARD else WATCHDOG):
            self.state = TRIPPED

    def _look(self) -> None:
        if self.state != ARMED:
            return
        if not (math.isfinite(self._tilt) and math.isfinite(self._rate)) or abs(self._tilt) > TILT_LIMIT:
            self.state = TRIPPED
        elif self._drive is Drive.ON_BOARD:
            place, speed, gives_way = self._reference
            self._asked = cut(2.0 * self._tilt + place + (0.5 if gives_way else 0.0), speed)

    def _take(self, message: Message, now: int) -> None:
        if isinstance(message, Hello):
            self._taken, self.state = message.seq, OFF if message.version == 2 else STRANGE
            return
        ahead = (message.seq - self._taken) % 2**16
        if self.state == STRANGE or ahead == 0 or ahead >= 2**15:
            return
        self._taken = message.seq
        match message:
            case Arm(drive=Drive.VOLTAGE):
                pass  # it takes no voltages
            case Arm(drive=drive):
                self.state, self._drive, self._asked, self._reference = ARMED, drive, AT_REST, HERE
                self._tick = self._heard = now
                self._look()
            case Stop():
                self.state = OFF
            case Command(total=total, difference=difference):
                finite = math.isfinite(total) and math.isfinite(difference)
                if self.state == ARMED and self._drive is Drive.TORQUE and finite:
                    self._asked, self._heard = cut(total, difference), now
            case Follow(position=place, speed=speed, heading=heading, yaw_rate=turn, gives_way=gives_way):
                finite = all(map(math.isfinite, (place, speed, turn))) and not math.isinf(heading)
                if self.state == ARMED and self._drive is Drive.ON_BOARD and finite:
                    self._reference, self._heard = (place, speed, gives_way), now
