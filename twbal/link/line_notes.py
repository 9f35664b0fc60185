"""What went wrong on the line in a rollout and was made good: noted as events of the episode."""

from twbal.core.episode import Event
from twbal.link.exchange import Exchange
from twbal.link.protocol import Telemetry


class LineNotes:
    """Notes of one rollout.

    Args:
        line: whose counts are looked at.

    Attributes:
        events: so far.
        missed_periods: control periods that passed without a command in time.
    """

    def __init__(self, line: Exchange) -> None:
        self._line = line
        self.begin()

    def begin(self) -> None:
        """Forget the rollout before."""
        self.events: list[Event] = []
        self.missed_periods = 0
        self._counter_stands = False
        self._heard_damaged, self._sent_again = self._line.bad_frames, self._line.sent_again

    def add(self, time: float, text: str) -> None:
        """Note something.

        Args:
            time: since the rollout began [s].
            text: what it is.
        """
        self.events.append(Event(time, text))

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
        if damaged := self._line.bad_frames - self._heard_damaged:
            self.add(time, f"{damaged} damaged frames came from the robot")
        if again := self._line.sent_again - self._sent_again:
            self.add(time, f"a command was sent again, {again} times, before it was answered")
        self._heard_damaged, self._sent_again = self._line.bad_frames, self._line.sent_again

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
