"""The kinds of faults, and what is right after each."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from random import Random

from benchmarks.link_faults.disturbances import (
    Frames,
    OtherClock,
    Way,
    WithoutStop,
    as_it_came,
    corrupted,
    doubled,
    dropped,
    lost,
    swapped,
)

PERIOD_US = 20_000
_EVER = float("inf")


@dataclass(frozen=True)
class Kind:
    """A kind of fault.

    Attributes:
        name: of it.
        right: what must become of the rollout: "rides" (exit code 0), "ends" (an error), "either": as the bytes that
            came through allow; "falls": the link cannot tell, so that the robot stands or falls as it may.
        to_robot: makes what becomes of bytes to the robot.
        to_host: makes what becomes of bytes to the host.
        seconds: how long it lasts.
        act: what happens besides: "vanish", "kill", "reset", or "deaf": the host hears nothing after its first Stop;
            empty: nothing.
        begins: in which control period.
        sensors: how sensors fail in the robot itself, as `Watched` reads it.
        rollouts: how many; the last one has the fault.
        again: whether the same command is given once more, and must then come to its end.
        changes: whether it changes what frames say, which no episode can tell.
        because: what the error must say, one of these; none: whatever it says.
    """

    name: str
    right: str
    to_robot: Callable[[Random], Way] = lambda rng: as_it_came
    to_host: Callable[[Random], Way] = lambda rng: as_it_came
    seconds: float = _EVER
    act: str = ""
    begins: int = 15
    sensors: str = ""
    rollouts: int = 1
    again: bool = False
    changes: bool = False
    because: tuple[str, ...] = ()


NONE = Kind("none", "rides")
"""No fault."""


def kinds(clock: str) -> Mapping[str, Kind]:
    """All kinds by their names, for a robot in lockstep or in real time."""
    made = [NONE, *_bytes(), *_frames(), *_silence(clock == "real_time"), *_others()]
    return {kind.name: kind for kind in made}


def _bytes() -> list[Kind]:
    """Both ways the same share."""
    fates = {"dropped": dropped, "doubled": doubled, "swapped": swapped, "corrupted": corrupted}

    def kind(fate: str, share: float) -> Kind:
        def make(rng: Random) -> Way:
            return fates[fate](share, rng)

        return Kind(f"bytes {fate}, {100 * share:g} %", "either", make, make)

    return [kind(fate, share) for fate in fates for share in (0.001, 0.01, 0.1)]


def _frames() -> list[Kind]:
    def kind(fate: str, share: float) -> Kind:
        def make(rng: Random) -> Way:
            return Frames(share, rng, fate)

        return Kind(f"frames {fate}, {100 * share:g} %", "either", make, make)

    return [kind(fate, 0.1) for fate in ("dropped", "doubled", "swapped")]


def _silence(in_real_time: bool) -> list[Kind]:
    """A robot in real time stops itself after 0.1 s; the host gives up after 0.5 s."""
    longest = 0.05 if in_real_time else 0.2
    found = []
    for seconds in (0.05, 0.2, 1.0, 5.0):
        right = "rides" if seconds <= longest else "ends"
        named = f"{1000 * seconds:g} ms" if seconds < 1 else f"{seconds:g} s"
        found += [
            Kind(f"silence to the robot, {named}", right, to_robot=lambda rng: lost, seconds=seconds),
            Kind(f"silence to the host, {named}", right, to_host=lambda rng: lost, seconds=seconds),
        ]
    return found


def _others() -> list[Kind]:
    off = "THEY MAY STILL BE ON"

    def clock(name: str, right: str, told: Callable[[int, int], int]) -> Kind:
        because = () if right == "rides" else ("does not run forward",)
        begins = 0 if right == "rides" else 15
        return Kind(
            f"clock {name}", right, to_host=lambda rng: OtherClock(told), begins=begins, changes=True, because=because
        )

    return [
        Kind("port vanishes and comes back", "ends", act="vanish", again=True, because=("is gone",)),
        Kind("host killed", "ends", act="kill", rollouts=2, again=True),
        Kind("robot starts anew", "ends", act="reset", again=True),
        Kind("tilt becomes NaN", "ends", sensors="nan:tilt", because=("no number (tilt)",)),
        Kind("wheel rate becomes NaN", "ends", sensors="nan:wheel_rate", because=("no number (wheel rate)",)),
        Kind("yaw rate becomes NaN", "ends", sensors="nan:yaw_rate", because=("not finite numbers",)),
        Kind("IMU frozen", "ends", sensors="frozen:tilt,tilt_rate,yaw_rate,acceleration", because=("same",)),
        Kind("encoders frozen", "falls", sensors="frozen:wheel_angle,wheel_rate"),
        clock("frozen", "ends", lambda begin, now: begin),
        clock("backward", "ends", lambda begin, now: 2 * begin - now),
        clock("wraps", "rides", lambda begin, now: now - begin - 10 * PERIOD_US),
        Kind("first Stop lost", "rides", to_robot=lambda rng: WithoutStop(1)),
        Kind("each Stop lost", "ends", to_robot=lambda rng: WithoutStop(10**6), because=(off,)),
        Kind("answers to Stop lost", "ends", act="deaf", because=(off,)),
    ]
