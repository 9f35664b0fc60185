"""What a diagnosis says: the record that reports draw and that `diagnosis.json` keeps."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple


class Verdict(StrEnum):
    """What a diagnosis comes to."""

    NAMED = "named"
    """The data say which effects the simulation lacks."""
    NONE = "none"
    """The simulation explains the data; nothing is missing that they could show."""
    DATA_SHEET = "data_sheet"
    """No effect is missing, but parameters of the data sheet are off."""
    UNKNOWN = "unknown"
    """There is a gap, and nothing in the library explains it."""
    UNDECIDED = "undecided"
    """The data are too poor to tell; another recording could."""


class Estimate(NamedTuple):
    """A parameter with its 95 % interval, all in `unit`.

    Attributes:
        value: estimate.
        low95: lower end.
        high95: upper end.
        unit: "" for a plain number.
    """

    value: float
    low95: float
    high95: float
    unit: str


@dataclass(frozen=True)
class NamedEffect:
    """An effect that the simulation lacks.

    Attributes:
        name: of the effect, as in conf/effect/.
        probability: that this name, or one of the equivalents, is right; calibrated.
        parameters: by name, as the effect in the simulation takes them.
        equivalents: effects that these data cannot tell from it.
        separate_by: the experiment that would tell them apart; "" where there are none.
    """

    name: str
    probability: float
    parameters: Mapping[str, Estimate]
    equivalents: tuple[str, ...]
    separate_by: str


class Rival(NamedTuple):
    """A candidate that was weighed.

    Attributes:
        names: effects it holds, sorted; () is the data sheet refitted.
        score: twice the log likelihood it gains over the data sheet alone, less its parameters' price [nats].
        probability: calibrated.
        whiteness: of the residuals it leaves; 1 is white.
    """

    names: tuple[str, ...]
    score: float
    probability: float
    whiteness: float


class Shift(NamedTuple):
    """How far the data pull a parameter of the data sheet.

    Attributes:
        name: the parameter.
        group: class of parameters that such data hardly tell apart ("gain, mass and inertia", "height and radius").
        factor: times the data sheet's value.
        sigmas: the shift in standard deviations of its tolerance.
    """

    name: str
    group: str
    factor: float
    sigmas: float


class Region(NamedTuple):
    """Disagreement of a channel within a region of the data.

    Attributes:
        channel: measured channel ("tilt", "tilt_rate", "wheel_angle", "wheel_rate").
        axis: what the region is a range of ("speed", "command", "tilt", "direction", "time").
        low: lower end of the range [SI].
        high: upper end [SI].
        samples: in it.
        bias: mean error of the simulation over its noise, both of one control period.
        rms: root mean square error over that noise; 1 is noise alone.
    """

    channel: str
    axis: str
    low: float
    high: float
    samples: int
    bias: float
    rms: float


class Gap(NamedTuple):
    """Error of the simulation over one horizon on held-out episodes, rms of a channel [its unit].

    Attributes:
        channel: measured channel.
        horizon: of the rollouts [s].
        before: by the data sheet.
        refitted: by the data sheet refitted within its tolerances.
        after: with the named effects.
        floor: what sensor noise alone would leave.
        closed: share of before - floor that is closed; None where before is within 10 % of the floor.
    """

    channel: str
    horizon: float
    before: float
    refitted: float
    after: float
    floor: float
    closed: float | None


class Whiteness(NamedTuple):
    """How coloured a channel's one-step residuals are; 1 is white.

    Attributes:
        channel: measured channel.
        before: by the data sheet.
        after: with the named effects.
    """

    channel: str
    before: float
    after: float


@dataclass(frozen=True)
class Diagnosis:
    """What the measured episodes say about a simulation.

    Attributes:
        verdict: in one word.
        effects: named ones; empty unless the verdict is `named`.
        data_sheet: shifts of the free data-sheet parameters, the largest first.
        data_sheet_class: groups that are off; empty unless the verdict is `data_sheet`.
        rivals: all candidates weighed, the best first.
        where: regions of disagreement by the data sheet, the largest first.
        gap: per channel and horizon on held-out data.
        held_out: names of the episodes (or stretches of them) it was measured on.
        whiteness: per channel.
        noise: standard deviations of the sensors, by channel, as fitted.
        advice: plain sentences: what the data do not carry, what to do next.
    """

    verdict: Verdict
    effects: tuple[NamedEffect, ...]
    data_sheet: tuple[Shift, ...]
    data_sheet_class: tuple[str, ...]
    rivals: tuple[Rival, ...]
    where: tuple[Region, ...]
    gap: tuple[Gap, ...]
    held_out: tuple[str, ...]
    whiteness: tuple[Whiteness, ...]
    noise: Mapping[str, float]
    advice: tuple[str, ...]
