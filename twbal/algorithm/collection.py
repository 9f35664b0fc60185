"""Many rollouts of a simulated robot, over several processes."""

import math
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial

from twbal.algorithm.rollout import Watch, rollout
from twbal.algorithm.settings import RolloutSettings
from twbal.algorithm.simulation import Simulation
from twbal.core.channels import Channels
from twbal.core.copies import end_with, is_copy
from twbal.core.episode import Episode, Outcome, Provenance, in_sentences
from twbal.core.errors import ConfigError, DataError, LinkLostError
from twbal.core.plant import Plant
from twbal.core.threads import cores
from twbal.policies.exploring import ExploringPolicy
from twbal.policies.policy import Policy

WORTH_A_PROCESS = 25  # rollouts: a fall takes some 20 ms, a process half a second to start


@dataclass(frozen=True)
class RolloutPlan:
    """What is the same in every rollout of a collection.

    Attributes:
        make_plant: makes the robot; must be picklable, as each process makes its own.
        policy: that drives it.
        channels: the state.
        steps: control periods at most.
        tilt_limit: at which a rollout ends [rad].
        new_watch: makes what looks at the observations of a rollout and may end it; None: nothing does.
    """

    make_plant: Callable[[], Plant]
    policy: Policy
    channels: Channels
    steps: int
    tilt_limit: float
    new_watch: Callable[[], Watch] | None = None

    def drive(self, provenances: Sequence[Provenance]) -> Iterator[Episode]:
        """One rollout for each provenance, all on one plant.

        Raises:
            KeyboardInterrupt: the person stopped it; a simulated rollout that was cut short is worth nothing.
            LinkLostError: the robot fell silent, or does not confirm that it has stopped.
            DataError: the policy or the simulation came to what is no number.
        """
        with self.make_plant() as plant:
            yield from self.drive_on(plant, provenances)

    def drive_on(self, plant: Plant, provenances: Sequence[Provenance]) -> Iterator[Episode]:
        """The same on a plant that is there already, and stays open."""
        for provenance in provenances:
            watch = None if self.new_watch is None else self.new_watch()
            of = self.policy, self.channels, self.steps, self.tilt_limit, provenance
            episode = rollout(plant, *of, watch=watch)
            if episode.outcome is Outcome.STOPPED:
                raise KeyboardInterrupt
            if episode.outcome in (Outcome.POLICY_FAULT, Outcome.LINK_LOST):
                error = DataError if episode.outcome is Outcome.POLICY_FAULT else LinkLostError
                why = in_sentences(episode.events)
                raise error(f"Rollout {provenance.trial} broke off: {why}")
            yield episode

    def drive_all(self, provenances: Sequence[Provenance]) -> list[Episode]:
        """What `drive` yields, as a process can send it back."""
        return list(self.drive(provenances))


def explored(policy: Policy, settings: RolloutSettings, torque_limit: float) -> Policy:
    """The policy with the noise on its command that the settings ask for; `torque_limit` is in N·m."""
    if not settings.exploration:
        return policy
    return ExploringPolicy(policy, settings.exploration * torque_limit, torque_limit, settings.exploration_steps)


def simulate(
    simulation: Simulation,
    policy: Policy,
    channels: Channels,
    settings: RolloutSettings,
    provenance: Provenance,
    workers: int = 1,
) -> Iterator[Episode]:
    """Rollouts of a simulated robot; the same whatever the number of processes.

    Args:
        simulation: the robot.
        policy: that drives it.
        channels: the state.
        settings: which rollouts.
        provenance: of all of them, but for their numbers.
        workers: see `collect`.
    """
    driver = explored(policy, settings, simulation.robot.torque_limit)
    make_plant = partial(simulation.plant, settings.seed)
    plan = RolloutPlan(make_plant, driver, channels, settings.steps, settings.tilt_limit)
    return collect(plan, [replace(provenance, trial=trial) for trial in settings.numbers], workers)


def collect(plan: RolloutPlan, provenances: Sequence[Provenance], workers: int) -> Iterator[Episode]:
    """The rollouts that `provenances` name, in their order; the same whatever the number of processes.

    Args:
        plan: what is the same in each.
        provenances: one a rollout; its seed and trial draw start, noise and the policy's randomness.
        workers: processes; 0 takes one a core. Fewer are used where they would not be worth their start. Where one of
            them ends before its work is done, this process does what is left: a new process reads the program's main
            module, and ends at once where that does its work without `if __name__ == "__main__"`.

    Raises:
        ConfigError: a negative number of processes.
    """
    if workers < 0:
        raise ConfigError(f"The number of workers must be 0 (one a core) or more; found {workers}.")
    useful = math.ceil(len(provenances) / WORTH_A_PROCESS)
    workers = (
        1 if is_copy() else min(workers or cores(), useful)
    )  # it may be ended at any instant, and others would stay
    done = 0
    if workers > 1:
        end_if_read_again()
        with suppress(BrokenProcessPool):
            for episodes in _by_processes(plan, provenances, workers):
                yield from episodes
                done += len(episodes)
    if done < len(provenances):
        yield from plan.drive(provenances[done:])


def _by_processes(plan: RolloutPlan, provenances: Sequence[Provenance], workers: int) -> Iterator[list[Episode]]:
    """The rollouts in their order, a part of them at a time, by so many processes.

    Raises:
        BrokenProcessPool: a process ended before its work was done.
    """
    size = math.ceil(len(provenances) / (4 * workers))
    parts = [provenances[i : i + size] for i in range(0, len(provenances), size)]
    # Spawned, not forked: a fork would copy the threads' locks of the libraries that this process has loaded.
    spawn = multiprocessing.get_context("spawn")
    others = multiprocessing.active_children()
    pool = ProcessPoolExecutor(workers, spawn, end_with, (os.getpid(),))
    try:
        with _interrupts_held_back():
            driven = [pool.submit(plan.drive_all, part) for part in parts]
        for part in driven:
            yield part.result()
    except BaseException:  # also Ctrl-C: nobody waits for what they are at
        for process in multiprocessing.active_children():
            if process not in others:
                process.terminate()
        raise
    finally:
        pool.shutdown()


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Processes that are started within do not hear of Ctrl-C; this process does after it, and ends them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_if_read_again() -> None:
    """End this process where it was started to work for a program, and still reads that program's main module.

    Where the module has no `if __name__ == "__main__"`, such a process would do all that the program does: it would
    drive the same robot.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False):  # as multiprocessing itself asks
        raise SystemExit(
            "twbal: a process that was started to simulate beside the program read its main module, which does its "
            "work as it is read. The process ends; the program goes on alone, but slower. Put what the module does "
            'under `if __name__ == "__main__":`.'
        )
