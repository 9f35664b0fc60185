"""One robot, driven through all tasks by one policy."""

from collections.abc import Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
from hydra import compose
from hydra.utils import instantiate

from benchmarks.driving.judging import Driven, measured_of, passed
from benchmarks.driving.pushed import PushedOnce
from benchmarks.driving.tasks import Task, tasks
from benchmarks.hidden_robots.families import Family
from benchmarks.hidden_robots.robots import Workshop
from twbal.algorithm.rollout import rollout
from twbal.cli.composition import composing
from twbal.core.channels import Channels
from twbal.core.episode import Episode, Provenance
from twbal.core.feed_forward import FeedForward
from twbal.core.heading_control import HeadingControl
from twbal.core.plant import Plant
from twbal.core.yielding import yields_to_pushes
from twbal.policies.saved import load_policy

FIRST_TRIAL = 2000
"""Number of the first rollout; those before were driven to learn, to decide or to be pushed."""


class Driver:
    """Drives the robots of a family.

    Args:
        family: of them.

    Attributes:
        tasks: that each is given.
        asked: hash of them, and of whether the robots yield to pushes.
    """

    def __init__(self, family: Family) -> None:
        self._workshop = Workshop(family)
        with composing():
            words = [f"robot={family.sheet}", "state=default", "policy.path=none"]
            self._channels: Channels = instantiate(compose("real_rollout", words).state)
        self.tasks = tuple(tasks(self._workshop.sheet))
        self._yields = yields_to_pushes(None, self._workshop.sheet)
        asked = (self.tasks, "yields") if self._yields else self.tasks
        self.asked = sha256(repr(asked).encode()).hexdigest()

    def drive(self, seed: int, policy: Path) -> dict[str, Any]:
        """What robot `seed` did in each task under a policy.

        With it comes by how much its wheels are larger than those of the sheet [per cent]: so much faster than its
        encoders tell it drives.
        """
        found = []
        for number, task in enumerate(self.tasks):
            episode = self.episode(seed, policy, task, FIRST_TRIAL + number)
            found.append({"name": task.name, "choice": task.choice, **self._judged(episode, task)})
        larger = 100.0 * (fmean(self._workshop.truth(seed).body.wheel_radius) / self._workshop.sheet.wheel_radius - 1.0)
        known = {"seed": seed, "policy": digest(policy), "asked": self.asked, "wheels_larger": round(larger, 2)}
        return {**known, "tasks": found}

    def episode(self, seed: int, policy: Path, task: Task, trial: int) -> Episode:
        """One task."""
        shop, sheet = self._workshop, self._workshop.sheet
        truth = shop.truth(seed)
        if task.slope is not None:
            truth = replace(truth, surroundings=replace(truth.surroundings, slope=task.slope))
        with shop.robot(seed, truth) as robot:
            plant: Plant = robot if task.push is None else PushedOnce(robot, task.push)
            assert task.course.heading is not None
            return rollout(
                plant=plant,
                policy=load_policy(policy, self._channels.names),
                channels=self._channels,
                steps=task.course.steps(sheet.control_period),
                tilt_limit=shop.rules.default.tilt_limit,
                provenance=Provenance(sheet.name, "robot", trial=trial),
                targets=task.course,
                heading=HeadingControl(sheet, task.course.heading, plant.has_yaw_gyro),
                feed_forward=FeedForward.of_robot(sheet),
                yields=self._yields,
            )

    def _judged(self, episode: Episode, task: Task) -> Mapping[str, Any]:
        """What became of a task."""
        assert episode.poses is not None
        limit, radius = self._workshop.rules.default.tilt_limit, self._workshop.sheet.wheel_radius
        driven = Driven(episode.observations[:, 0], np.asarray(episode.poses), task.course.segments, limit)
        gave_way = sum("gives way" in event.text for event in episode.events)
        told = {"seconds": round(episode.duration, 3), "gave_way": gave_way}
        if not driven.stood_up:
            return {"fell": True, "passed": False, "measured": [], **told}
        measured = measured_of(task.name, driven)
        return {"fell": False, "passed": passed(task.name, measured, radius), "measured": measured, **told}


def digest(file: Path) -> str:
    """SHA-256 of a file."""
    return sha256(file.read_bytes()).hexdigest()
