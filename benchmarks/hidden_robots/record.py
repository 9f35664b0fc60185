"""What is kept of a run of `twbal iterate` on a hidden robot."""

from collections.abc import Mapping
from dataclasses import asdict
from math import degrees
from pathlib import Path
from typing import Any

from benchmarks.hidden_robots.reference import Rules
from twbal.cli.artefacts import read_logs
from twbal.core.episode import Episode
from twbal.core.evaluation import judged
from twbal.core.robot_parameters import RobotParameters
from twbal.virtual_robot.ground_truth import GroundTruth

_KEPT = ("index", "real_seconds", "trial_seconds", "predicted_cost", "real_cost", "coverage95", "fit_s", "search_s")
_LATER = (
    "successes",
    "log_density",
    "crps",
    "crps_of_trials",
    "crps_ratio",
    "success_probability",
    "judged_success",
    "predicted_by",
    "reason",
    "same_policy_as",
)
"""What earlier results lack; `successes` are by the run's own rule."""
_PARTS = ("upright", "settled", "in_place", "quiet", "succeeded")


def main_numbers(truth: GroundTruth, sheet: RobotParameters) -> dict[str, float]:
    """The main ones of what a robot hides; masses and heights over the data sheet's."""
    drive = truth.drive
    return {
        "torque_gain": 0.5 * sum(drive.gain),
        "dead_zone": max(drive.dead_zone),
        "delay_ms": 1000.0 * drive.delay,
        "coulomb_friction": truth.friction.coulomb,
        "body_mass": truth.body.mass / sheet.body_mass,
        "com_height": truth.body.com_height / sheet.com_height,
        "com_offset_deg": degrees(truth.body.com_offset),
        "slope_deg": degrees(truth.surroundings.slope),
    }


def trial_record(episode: Episode, rules: Rules) -> dict[str, Any]:
    """What a trial shows, and of which parts each rule is content."""
    verdict = judged(episode, rules.default)
    shown: dict[str, Any] = {
        "seconds": verdict.seconds,
        "farthest": verdict.farthest,
        "command_change": verdict.command_change,
        "oscillation_deg": None if verdict.oscillation is None else degrees(verdict.oscillation),
    }
    for name, rule in rules._asdict().items():
        verdict = judged(episode, rule)
        shown[name] = {part: getattr(verdict, part) for part in _PARTS}
    return shown


def iteration_records(folder: Path, summary: Mapping[str, Any], rules: Rules) -> list[dict[str, Any]]:
    """One record an iteration: its figures in `summary.json`, and each of its trials, judged by both rules."""
    found = []
    for iteration in summary["iterations"]:
        trials = folder / f"iteration_{iteration['index']}" / "trials"
        episodes = read_logs([trials]) if trials.is_dir() else ()
        kept = {name: iteration[name] for name in _KEPT} | {name: iteration.get(name) for name in _LATER}
        found.append({**kept, "trials": [trial_record(episode, rules) for episode in episodes]})
    return found


def robot_record(truth: GroundTruth, sheet: RobotParameters, reference: Any) -> dict[str, Any]:
    """What is known of a robot before anything is learned."""
    return {"hidden": main_numbers(truth, sheet), "reference": asdict(reference)}
