"""One loop that drives a robot, simulated or real, and records what it did."""

import numpy as np

from twbal.channels import Channels
from twbal.episode import Episode, Event, Outcome, Provenance
from twbal.errors import DataError, LinkLostError
from twbal.plant import Observation, Plant
from twbal.policies.policy import Policy
from twbal.streams import Stream, generator


def rollout(
    plant: Plant,
    policy: Policy,
    channels: Channels,
    steps: int,
    tilt_limit: float,
    provenance: Provenance,
) -> Episode:
    """Drive `plant` by `policy` for at most `steps` control periods.

    The rollout ends early where the tilt passes its limit, the robot falls silent or the person presses Ctrl-C; the
    episode so far is returned with that outcome, and the motors are stopped on every way out.

    Args:
        tilt_limit: measured |tilt| at which the rollout ends [rad].
        provenance: its seed and trial seed the policy's randomness too.

    Raises:
        LinkError: the robot could not be reached at all.
        DataError: the robot sent a value that is not a finite number.
    """
    rng = generator(Stream.EXPLORATION, provenance.seed, provenance.trial)
    seen: list[Observation] = []
    states: list[np.ndarray] = []
    commands: list[float] = []
    events: list[Event] = []
    outcome = Outcome.COMPLETED

    def note(observation: Observation) -> None:
        if not np.isfinite(observation).all():
            raise DataError(
                f"The robot sent a value that is not a finite number: {observation}. Its motors are stopped."
            )
        seen.append(observation)
        states.append(channels.state(observation, commands))

    try:
        controller = policy.controller(rng)
        note(plant.reset(provenance.trial))
        while len(commands) < steps:
            if abs(seen[-1].tilt) > tilt_limit:
                outcome = Outcome.TILT_LIMIT
                break
            command = controller(states[-1])
            observation = plant.step(command)
            commands.append(command)
            note(observation)
    except (LinkLostError, KeyboardInterrupt) as end:
        if not states:
            raise
        outcome = Outcome.LINK_LOST if isinstance(end, LinkLostError) else Outcome.STOPPED
        events.append(Event(seen[len(states) - 1].time, str(end) or "stopped by the person"))
    finally:
        plant.stop()
    complete = len(states)  # Ctrl-C may come between two of the records
    return Episode(
        channels=channels.names,
        control_period=plant.control_period,
        observations=np.array(seen[:complete]),
        states=np.array(states),
        commands=np.array(commands[: complete - 1]),
        outcome=outcome,
        provenance=provenance,
        events=tuple(events),
    )
