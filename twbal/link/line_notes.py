"""What went wrong on the line in a rollout and was made good: noted as events of the episode."""

from twbal.core.episode import Event
from twbal.link.exchange import Exchange, Sending
from twbal.link.protocol import Status, Telemetry


class LineNotes:
    """Notes of one rollout.

    Args:
        line: whose counts are looked at.

    Attributes:
        missed_periods: control periods that passed without a command in time.
    """

    def __init__(self, line: Exchange) -> None:
        self._line = line
        self.begin()

    def begin(self) -> None:
        """Forget the rollout before."""
        self._noted: list[tuple[float, str | Sending]] = []
        self.missed_periods = 0
        self._counter_stands = False
        self._noted_kinds: set[str] = set()  # of what is noted once
        self._cut_periods, self._cut_first = 0, 0.0  # in which the robot cut a command; time of the first [s]
        self._heard_damaged = self._line.bad_frames

    @property
    def events(self) -> tuple[Event, ...]:
        """All so far. Whether a command was sent in vain is known once the next one is answered."""
        texts = [(time, _in_words(note) if isinstance(note, Sending) else note) for time, note in self._noted]
        if self._cut_periods:
            cut = f"in {self._cut_periods} control periods the robot cut the command below the limit that it announced"
            texts.append((self._cut_first, f"{cut}: what acted is less than what is recorded"))
        return tuple(Event(time, text) for time, text in texts if text)

    def add(self, time: float, text: str) -> None:
        """Note something.

        Args:
            time: since the rollout began [s].
            text: what it is.
        """
        self._noted.append((time, text))

    def add_once(self, time: float, kind: str, text: str) -> None:
        """Note something unless its kind was noted before in this rollout.

        Args:
            time: since the rollout began [s].
            kind: of what it is.
            text: what it is.
        """
        if kind not in self._noted_kinds:
            self._noted_kinds.add(kind)
            self.add(time, text)

    def follow(self, before: Telemetry, now: Telemetry, time: float) -> None:
        """Note what went wrong between two telemetry messages.

        Args:
            before: the one that was used last.
            now: the next one.
            time: of `before`, since the rollout began [s].
        """
        self._count_missed((now.period - before.period) % 2**16 - 1, time)
        dropped = (now.dropped - before.dropped) % 2**16
        if 0 < dropped < 2**15:
            self.add(time, f"the robot dropped {dropped} damaged or outdated frames")
        if now.status & Status.LIMITED and not now.status & Status.ON_BOARD:  # the host keeps to what was announced
            self._cut_first = self._cut_first if self._cut_periods else time
            self._cut_periods += 1
        if damaged := self._line.bad_frames - self._heard_damaged:
            self.add(time, f"{damaged} damaged frames came from the robot")
        if self._line.sending.repeated:
            self._noted.append((time, self._line.sending))
        self._heard_damaged = self._line.bad_frames

    def _count_missed(self, periods: int, time: float) -> None:
        if 0 <= periods < 2**15:
            self.missed_periods += periods
            if periods:
                self.add(time, f"{periods} control periods passed without a command in time")
        elif not self._counter_stands:
            self._counter_stands = True
            self.add(
                time, "the robot's count of its control periods does not run forward, so missed ones are not noticed"
            )


def _in_words(sending: Sending) -> str:
    """What is noted of a command; nothing where each sending of it was answered, so that it was only late."""
    return f"a command was sent again, {sending.repeated} times, before it was answered" if sending.repeated else ""
