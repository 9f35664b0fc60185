"""`evidence.json`: under which base of g the real transitions are likeliest."""

from dataclasses import dataclass
from pathlib import Path

from twbal.core.errors import DataError
from twbal.core.json_records import read_record


@dataclass(frozen=True)
class BaseEvidence:
    """A choice among bases of g.

    Attributes:
        channels: the E measured ones.
        dynamics: sha256 of each base's `model.pt`; None stands for no simulation.
        log_evidences: of each base the log evidence of the real transitions, channel by channel [nats].
        chosen: index of the base that was kept.
    """

    channels: tuple[str, ...]
    dynamics: tuple[str | None, ...]
    log_evidences: tuple[tuple[float, ...], ...]
    chosen: int

    def __post_init__(self) -> None:
        lengths = {len(each) for each in self.log_evidences}
        if len(self.dynamics) != len(self.log_evidences) or lengths != {len(self.channels)}:
            raise DataError(f"Each of {len(self.dynamics)} bases needs the evidence of {len(self.channels)} channels.")
        if not 0 <= self.chosen < len(self.dynamics):
            raise DataError(f"The chosen base must be one of {len(self.dynamics)}; found {self.chosen}.")

    @property
    def totals(self) -> tuple[float, ...]:
        """Log evidence of each base over all channels [nats]."""
        return tuple(sum(each) for each in self.log_evidences)


def read_base_evidence(path: Path) -> BaseEvidence:
    """Read `evidence.json`.

    Raises:
        DataError: it is missing or holds something else.
    """
    try:
        return read_record(BaseEvidence, path)
    except FileNotFoundError as error:
        raise DataError(
            f"There is no {path}. `fit-diff-gp` writes it where `dynamics` lists several models."
        ) from error
