"""Messages to a robot and the answers to them."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from twbal.core.errors import LinkError
from twbal.link.decoder import Decoder, to_wire
from twbal.link.message import Message
from twbal.link.protocol import VERSION, Fault, PoseReport, Telemetry
from twbal.link.transport import Transport
from twbal.link.version_1 import VERSION_1, downgraded, upgraded

_STRANGE = "no handshake"  # in the Fault of a robot that has heard no Hello since it was switched on
_RESEND_AFTER = 0.05  # an unanswered message is sent again: within the robot's watchdog of 0.1 s [s]


@dataclass
class Sending:
    """One message of the host, and how often it was sent in vain.

    An answer that came late is no loss: the robot answers a repetition by the same message again, so that each sending
    has its answer.

    Attributes:
        number: of the message.
        repeated: how often it was sent again, less the answers to that.
    """

    number: int
    repeated: int = 0
    _period: int | None = None  # of the telemetry that answered it first

    def hear(self, answer: Message) -> None:
        """Look whether a message of the robot is one more answer to this one."""
        if not isinstance(answer, Telemetry) or answer.seq != self.number:
            return
        if self._period == answer.period:
            self.repeated = max(self.repeated - 1, 0)
        elif self._period is None:
            self._period = answer.period


class Exchange:
    """Numbers the host's messages, sends them, again where no answer comes, and finds the answers.

    Attributes:
        transport: the line.
        version: of the protocol that the robot speaks.
        sending: the last message, and how often it was sent in vain; that is final once the next one is answered.
        pose: what the robot said of its true pose together with its newest telemetry that answered; None where nothing.
    """

    def __init__(self, transport: Transport) -> None:
        self.transport = transport
        self.version = VERSION
        self.sending = Sending(0)
        self.pose: PoseReport | None = None
        self._said: PoseReport | None = None
        self._decoder = Decoder()
        self._number = self._period = 0  # of the last message; of the newest telemetry
        self._bytes, self._understood = 0, False  # that arrived; whether any message was among them

    @property
    def bad_frames(self) -> int:
        """Frames that arrived damaged so far."""
        return self._decoder.bad_frames

    def next_number(self) -> int:
        """The number for the next message."""
        self._number = (self._number + 1) % 2**16
        return self._number

    def ask(
        self,
        message: Message,
        timeout: float,
        until: Callable[[Message], bool] = lambda answer: True,
        resend_after: float = _RESEND_AFTER,
    ) -> Message:
        """Send `message`, again where no answer comes, and return the newest answer to it once that is as `until` says.

        It is sent again after a while, and at once where the robot has measured again without knowing of it.
        Messages are those of the newest version; to a robot of an older one they are translated.

        Args:
            message: to send.
            timeout: how long to wait [s].
            until: which answers will do.
            resend_after: when it is sent again [s]; infinite: never, whatever comes.

        Raises:
            LinkError: it is answered by a fault, not at all, or not so.
            LinkLostError: the port is gone.
        """
        wire = to_wire(downgraded(message) if self.version == VERSION_1 else message)
        deadline = time.monotonic() + timeout
        before, self.sending = self.sending, Sending(message.seq)
        resend_at = now = 0.0
        self._decoder.unreadable = ""
        newest: Message | None = None
        while now < deadline:  # looked at before the read: an answer that came while this process slept still counts
            now = time.monotonic()
            if now >= resend_at:
                self.transport.write(wire)
                self.sending.repeated += resend_at > 0.0
                resend_at = now + resend_after
            for answer in self._arrived():
                for sending in (before, self.sending):
                    sending.hear(answer)
                if isinstance(answer, PoseReport):
                    self._said = answer
                elif answer.seq == message.seq:
                    if isinstance(answer, Fault):
                        raise LinkError(self._why_refused(answer))
                    newest, self.pose = answer, self._pose_at(answer)
                    self._period = answer.period if isinstance(answer, Telemetry) else self._period
                elif self._is_later(answer) and resend_after < math.inf:
                    resend_at = now
            if newest is not None and until(newest):
                return newest
        raise LinkError(self._why_none(type(message).__name__, timeout, newest))

    def listen(self, seconds: float) -> list[Message]:
        """What the robot says by itself within a time, in which it hears nothing.

        Args:
            seconds: how long [s].

        Raises:
            LinkLostError: the port is gone.
        """
        deadline, heard = time.monotonic() + seconds, list[Message]()
        while time.monotonic() < deadline:
            heard += self._arrived()
        return heard

    def _arrived(self) -> list[Message]:
        """Messages that have come, as those of the newest version."""
        data = self.transport.read()
        messages = self._decoder.feed(data)
        self._bytes, self._understood = self._bytes + len(data), self._understood or bool(messages)
        return [upgraded(message) for message in messages]

    def _is_later(self, answer: Message) -> bool:
        """Whether this is telemetry of a later control period than all before; from now on it is one of those."""
        if not isinstance(answer, Telemetry) or not 0 < (answer.period - self._period) % 2**16 < 2**15:
            return False
        self._period = answer.period
        return True

    def _pose_at(self, answer: Message) -> PoseReport | None:
        """The pose that the robot said just before this answer, if it is of the same instant."""
        said, self._said = self._said, None
        if said is None or not isinstance(answer, Telemetry):
            return None
        return said if (said.seq, said.period) == (answer.seq, answer.period) else None

    def _why_refused(self, fault: Fault) -> str:
        found = f"The robot on {self.transport.name} cannot follow: {fault.text}."
        if _STRANGE not in fault.text:
            return found
        return f"{found} So it has started anew since the last one: does its supply hold when the motors run?"

    def _why_none(self, sent: str, timeout: float, newest: Message | None) -> str:
        where = f"from the robot on {self.transport.name} within {timeout:.3g} s"
        if isinstance(newest, Telemetry):
            return f"All that came {where} in answer to {sent} says that it is armed."
        if newest is not None:
            return f"All that came {where} in answer to {sent} is {newest}."
        if self._decoder.unreadable:
            return (
                f"No answer to {sent} {where} can be read; the last was {self._decoder.unreadable}. Does its firmware "
                "keep to docs/protocol.md?"
            )
        if self._bytes and not self._understood:
            return (
                f"No answer to {sent} {where}: {self._bytes} bytes came, but not from a twbal robot. Is it the right "
                "port (another device talks there), and is link.baud_rate right? Or its firmware does not keep to "
                "docs/protocol.md."
            )
        return (
            f"No answer to {sent} {where} ({self.bad_frames} damaged frames so far). Is it switched on, and is the "
            "baud rate right?"
        )
