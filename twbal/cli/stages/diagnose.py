"""Name what a simulation lacks to explain measured episodes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
from omegaconf import DictConfig, OmegaConf

from twbal.cli.artefacts import DIAGNOSIS, episode_files, episodes_of, say_duplicates
from twbal.cli.console import gently, next_command, print_result, run_folder, say, say_link
from twbal.cli.diagnosis_config import diagnosis_of
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.recorded_period import take_recorded_period, virtual_robot_at
from twbal.cli.sim_files import AUGMENTED, simulation_text
from twbal.cli.typed_config import recorded
from twbal.core.files import write_atomically
from twbal.diagnosis.calibration import calibration
from twbal.diagnosis.diagnosis_file import concluded, write_diagnosis
from twbal.diagnosis.findings import FilterResult
from twbal.diagnosis.inputs import DataSettings, DiagnosedSimulation, NamedEpisodes
from twbal.diagnosis.log_names import distinct_names
from twbal.diagnosis.pipeline import DiagnosisResult, diagnose_episodes
from twbal.diagnosis.record import Diagnosis
from twbal.diagnosis.settings import Settings
from twbal.io.logs import read_episode
from twbal.sysid.model import Offsets
from twbal.viz.canvas import svg
from twbal.viz.diagnosis_figures import (
    autocorrelation_figure,
    disagreement_figure,
    gap_figure,
    reliability_figure,
    rivals_figure,
)
from twbal.viz.diagnosis_page import DiagnosisSetting, write_diagnosis_report
from twbal.viz.free_form_figure import free_form_figure
from twbal.viz.headline import effect_lines, headline_text

NOT_RECORDED = ("episodes", "test_episodes")
REPORT, FIGURES = "report.html", "figures"
_UNITS = {"tilt": "rad", "tilt_rate": "rad/s", "wheel_angle": "rad", "wheel_rate": "rad/s"}
_MOST_RIVALS = 10
_FAR = 3.0  # tolerances by which a nominal parameter must be off to stand for something else


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    files = episode_files(cfg.episodes)
    take_recorded_period(cfg, "diagnose", [*files, *_test_files(cfg)])
    made = run(cfg, out)
    found = concluded(out / DIAGNOSIS)
    if found.suggested and not found.is_open:
        say(f"to tell apart what is left: {found.suggested}")
    if found.is_better_unchanged and not found.is_open:
        say(
            "the simulation as it was predicts held-out data better than with the refitted data sheet: keep it as it is"
        )
    following = suggested_next(out, _recorded_by(files), virtual_robot_at(cfg.robot.control_period))
    if drives_a_robot(following):
        say_link("drives", following)
    print_result(made, out, following)


def drives_a_robot(following: str) -> bool:
    """Whether what comes next is a command that drives a robot, and no advice or other command."""
    return following.startswith("twbal real-rollout")


def _recorded_by(files: Sequence[Path]) -> object:
    """The `policy.command_width` of the regulator under which the first episode was recorded; None: it had none."""
    recorded_with = OmegaConf.create(read_episode(files[0]).provenance.config)
    return OmegaConf.select(recorded_with, "policy.command_width")


def suggested_next(
    out: Path,
    recorded_by: object = None,
    robot: Mapping[str, object] = MappingProxyType({}),
) -> str:
    """The command that comes after the diagnosis in a folder, or what to do where none is safe.

    Args:
        out: the folder.
        recorded_by: as of `gently`.
        robot: setting that a virtual robot needs, as of `virtual_robot_at`.
    """
    found = concluded(out / DIAGNOSIS)
    if not found.is_open:
        if found.is_better_unchanged:
            return next_command("sim-collect", {}, "robot", "sim")
        return next_command("sim-collect", {"sim": out / AUGMENTED}, "robot")
    if found.has_no_safe_experiment:
        return f"see the advice above, and {out / REPORT}: no experiment that twbal knows is safe for this robot"
    if found.repetition_tells_more:
        return "record the robot again as before, and diagnose all recordings together: episodes=[..., ...]"
    return found.suggested or next_command("real-rollout", {**gently(recorded_by), **robot}, "robot")


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Diagnose the episodes that `cfg` names into `out`, unless that is done there already."""
    files = episode_files(cfg.episodes)
    tests = _test_files(cfg)
    say_duplicates([*files, *tests])
    simulation, settings, data = diagnosis_of(cfg)
    step = StageWork("diagnose", out, recorded(cfg, NOT_RECORDED), {"episodes": files, "test episodes": tests}, 0)
    return perform(step, lambda: _diagnose_to_files(files, tests, simulation, settings, data, out))


def _test_files(cfg: DictConfig) -> list[Path]:
    return episode_files(cfg.test_episodes) if cfg.test_episodes else []


def _diagnose_to_files(
    files: Sequence[Path],
    tests: Sequence[Path],
    simulation: DiagnosedSimulation,
    settings: Settings,
    data: DataSettings,
    out: Path,
) -> list[Path]:
    names = distinct_names([*files, *tests])
    measured, kept_back = (
        NamedEpisodes(episodes_of(these, simulation.robot.name), of)
        for these, of in ((files, names[: len(files)]), (tests, names[len(files) :]))
    )
    result = diagnose_episodes(measured, kept_back, simulation, settings, data, say)
    title, diagnosis = _title(result), result.diagnosis
    if diagnosis.verdict.is_open:
        diagnosis = replace(diagnosis, advice=(*diagnosis.advice, f"{AUGMENTED}: {title}"))
    if diagnosis.next_experiment is not None:
        experiment = {"experiment": "excite", **diagnosis.next_experiment.settings}
        virtual = virtual_robot_at(simulation.robot.control_period)
        command = next_command("real-rollout", {**experiment, **virtual}, "robot")
        diagnosis = replace(diagnosis, next_experiment=diagnosis.next_experiment._replace(command=command))
    said = f"verdict {diagnosis.verdict}: {headline_text(diagnosis)}"
    print("\n  ".join([said, *effect_lines(diagnosis), *diagnosis.advice]))
    write_diagnosis(out / DIAGNOSIS, diagnosis)
    made = result.simulation
    write_atomically(out / AUGMENTED, simulation_text(made.effects, made.physics_step, made.robot.name, title))
    pictures, drawn = _draw(diagnosis, out / FIGURES)
    split, robot = result.split, simulation.robot
    recordings = (*(() if split.are_ends else split.fitted), *(() if tests else split.kept_back))
    seconds = sum(len(recording) * recording.period for recording in recordings)
    facts = [
        ("robot", robot.name),
        ("effects in the simulation already", ", ".join(simulation.effects) or "none"),
        *_offsets(result.findings.named, [recording.name for recording in split.fitted]),
        *([("walk of the gyro's bias", diagnosis.gyro_bias_walk.text)] if diagnosis.gyro_bias_walk else []),
        ("noise of the sensors, as found", ", ".join(f"{k} {v:.2g} {_UNITS[k]}" for k, v in diagnosis.noise.items())),
    ]
    setting = DiagnosisSetting(robot.name, measured.names, seconds, str(out / AUGMENTED), _UNITS, facts)
    write_diagnosis_report(out / REPORT, diagnosis, setting, pictures)
    return [out / DIAGNOSIS, out / AUGMENTED, out / REPORT, *drawn]


def _title(result: DiagnosisResult) -> str:
    """What an augmented simulation is."""
    verdict, added = result.diagnosis.verdict, result.findings.added
    content = f"the simulation of robot {result.simulation.robot.name} with its data sheet refitted"
    if added:
        content += " and " + ", ".join(added).replace("_", " ")
    if result.diagnosis.lost_commands is not None:
        content += ", and lost commands"
    far = [shift for shift in result.diagnosis.data_sheet if abs(shift.sigmas) > _FAR]
    said = f"No finding (verdict {verdict}): {content}." if verdict.is_open else f"Verdict {verdict}: {content}."
    if far:
        values = ", ".join(f"{shift.name.replace('_', ' ')} × {shift.factor:.2g}" for shift in far)
        said += f" Nominal parameters far beyond their tolerances, which stand for what is not explained: {values}."
    return said


def _offsets(filtered: FilterResult, names: Sequence[str]) -> list[tuple[str, str]]:
    """Lines on what differs from recording to recording, where that was free."""
    tilts, torques, slopes = np.reshape(filtered.offsets, (-1, len(Offsets._fields))).T
    kinds = {
        "offsets of the tilt, as found": [f"{np.degrees(tilt):+.1f}°" for tilt in tilts if tilts.any()],
        "torque of each recording (its battery), as found": [f"{torque:+.1%}" for torque in torques if torques.any()],
        "ground of each recording, as found": [f"{np.degrees(slope):+.2f}°" for slope in slopes if slopes.any()],
    }
    lines = {what: zip(names, values, strict=True) for what, values in kinds.items() if values}
    return [(what, ", ".join(f"{name} {value}" for name, value in each)) for what, each in lines.items()]


def _draw(diagnosis: Diagnosis, folder: Path) -> tuple[dict[str, str], list[Path]]:
    """All pictures, as SVG text and as files."""
    figures = {
        "where": disagreement_figure(diagnosis.where, tuple(diagnosis.noise)),
        "rivals": rivals_figure(diagnosis.rivals, _MOST_RIVALS) if any(r.names for r in diagnosis.rivals) else None,
        "gap": gap_figure(diagnosis.gap, _UNITS, diagnosis.after) if diagnosis.gap else None,
        "whiteness": autocorrelation_figure(diagnosis.autocorrelation, diagnosis.after),
        "reliability": reliability_figure(calibration().reliability),
        "free_form": free_form_figure(diagnosis.free_form[0]) if diagnosis.free_form else None,
    }
    texts = {name: svg(figure) for name, figure in figures.items() if figure is not None}
    files = [folder / f"{name}.svg" for name in texts]
    for file, text in zip(files, texts.values(), strict=True):
        write_atomically(file, text)
    return texts, files
