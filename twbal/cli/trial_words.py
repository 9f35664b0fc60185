"""What `real-rollout` says of its trials: the floor that they need, how they ended, how a course was followed."""

from collections.abc import Sequence
from math import degrees, radians

from twbal.algorithm.following import FloorNeeded, FollowedCourse
from twbal.algorithm.tables import course_table
from twbal.core.episode import Episode, Outcome
from twbal.policies.excitation import Excitation
from twbal.policies.linear import LinearPolicy
from twbal.policies.policy import PolicyOfChannels


def trial_in_words(episode: Episode) -> str:
    """How a trial ended."""
    return f"trial {episode.provenance.trial}: {end_in_words(episode)}"


def end_in_words(episode: Episode) -> str:
    """How an episode ended, and after how long."""
    fell = episode.outcome is Outcome.TILT_LIMIT
    outcome = "fell (tilt limit)" if fell else episode.outcome.replace("_", " ")
    return f"{outcome} after {episode.duration:.2f} s, {len(episode)} samples"


def floor_of_course(need: FloorNeeded) -> str:
    """What the course needs, as a sentence."""
    sides = f", {need.left:.1f} m to its left and {need.right:.1f} m to its right" if need.left or need.right else ""
    behind = f"{need.behind:.1f} m behind it"
    ahead = f"the course needs {need.ahead:.1f} m of free floor ahead of the robot"
    return f"{ahead}, {behind}{sides}" if sides else f"{ahead} and {behind}"


def floor_of_excitation(policy: Excitation, seconds: float) -> str:
    """How far an excitation may drive the robot, as sentences."""
    per_degree = abs(policy.drift) * radians(1.0)
    return (
        f"the excitation asks for up to {policy.speed:.2g} m/s ({policy.reach:.1f} m forward or backward). Nothing "
        "keeps the robot in its place: for each degree by which it balances at another tilt than its sheet says, it "
        f"rolls off at {per_degree:.2g} m/s besides, {per_degree * seconds:.1f} m within a trial. Have much free "
        "floor, catch it, or press Ctrl-C before it meets anything"
    )


def floor_without_a_place(policy: PolicyOfChannels, seconds: float) -> str:
    """What floor a policy that does not keep its place needs in a trial of so many seconds, as sentences."""
    found = "nothing keeps the robot in its place: its policy does not heed the position (those of iterate do)"
    if isinstance(policy, LinearPolicy) and {"tilt", "speed"} <= set(policy.channels):
        tilt, speed = (float(policy.gain[policy.channels.index(name)]) for name in ("tilt", "speed"))
        if speed != 0.0:
            off = abs(tilt / speed) * radians(1.0)
            found += (
                ". For each degree by which it balances at another tilt than its sheet says, it rolls off at "
                f"{off:.2g} m/s, {off * seconds:.1f} m within a trial"
            )
    return f"{found}. Have much free floor on all sides, catch it, or press Ctrl-C before it meets anything"


def print_course(trials: Sequence[FollowedCourse]) -> None:
    """Print how the robot followed the course."""
    print(*course_table(trials), sep="\n")
    for trial in trials:
        gave = f"; the reference gave way {trial.gave_way} times" if trial.gave_way else ""
        how = "fell" if trial.fell else "upright"
        print(f"trial {trial.trial}: {how}; places by {trial.place_by}{_turned(trial)}{gave}")


def _turned(trial: FollowedCourse) -> str:
    """What became of the heading, as the end of a line."""
    if trial.heading_error is not None:
        returned = "" if trial.from_start is None else f"; at the end {trial.from_start:.2f} m from its start"
        return f"; heading off by at most {degrees(trial.heading_error):.1f}° from 5 s on{returned}"
    return "" if trial.turned is None else f", turned by {degrees(trial.turned):.0f}°, which nothing controls"
