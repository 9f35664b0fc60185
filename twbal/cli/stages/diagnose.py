"""Name what a simulation lacks to explain measured episodes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import NamedTuple

import numpy as np
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.cli.artefacts import episode_files
from twbal.cli.console import closing, next_command, run_folder
from twbal.cli.manifest import Manifest, Step, perform
from twbal.cli.typed_config import members, recorded, typed
from twbal.core.engine import dividing_step
from twbal.core.episode import Episode, Outcome
from twbal.core.files import write_atomically
from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.account import take_account
from twbal.diagnosis.advice import UNEXPLAINED
from twbal.diagnosis.candidates import tilt_offsets
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.findings import Account, Effects, Findings
from twbal.diagnosis.gap import Models, Stretches, measure_gaps
from twbal.diagnosis.name import name_effects
from twbal.diagnosis.record import Diagnosis, Verdict, verdict_in, write_diagnosis
from twbal.diagnosis.settings import Settings as DiagnosisSettings
from twbal.diagnosis.verdict import review
from twbal.diagnosis.wheel_friction import name_drag
from twbal.diagnosis.wheels_off_ground import ADVICE as IN_AIR
from twbal.diagnosis.wheels_off_ground import held, held_upright, wheels_in_air, without_rotors
from twbal.diagnosis.where import disagreement
from twbal.effects.library import effects_from, values_of
from twbal.io.logs import read_episode
from twbal.sim.replay import ReplayStart, replay
from twbal.sysid.held_out import Split, held_out
from twbal.sysid.recording import MEASURED, Usability, read_recordings
from twbal.viz.canvas import svg
from twbal.viz.diagnosis_figures import disagreement_figure, gap_figure, rivals_figure, whiteness_figure
from twbal.viz.diagnosis_page import DiagnosisPictures, DiagnosisSetting, write_diagnosis_report
from twbal.viz.headline import headline_text

NOT_RECORDED = ("episodes", "test_episodes")
DIAGNOSIS, REPORT, AUGMENTED, FIGURES = "diagnosis.json", "report.html", "augmented.yaml", "figures"
FEW_DATA = {"shortest": 15, "fewest": 150}
"""Settings for the rollouts of `iterate`, which wander and fall: they tell more than as much of a robot that stands."""
_GENTLY = {"experiment": "excite", "policy.command_width": 0.1}
_GENTLER = "record it by a gentler regulator, `experiment=excite policy.command_width=0.1`, or less."
_UNITS = {"tilt": "rad", "tilt_rate": "rad/s", "wheel_angle": "rad", "wheel_rate": "rad/s"}
_HISTORY = 5  # control periods before a rollout, for what a late IMU still shows
_MOST_RIVALS = 10


@dataclass(frozen=True)
class Settings:
    """See conf/stage/diagnose.yaml."""

    horizons: list[float]
    held_out: float
    starts: int
    bins: int
    shortest: int
    fewest: int
    fastest_turn: float
    widest_tilt: float


class Told(NamedTuple):
    """What a diagnosis is told beside the recordings.

    Attributes:
        robot: data sheet.
        present: effects that the simulation has already, by name.
        physics_step: of the simulation [s].
        estimating: how effects are named.
        settings: of the stage.
        in_air: whether the robot lies and its wheels turn in the air.
    """

    robot: RobotParameters
    present: Effects
    physics_step: float
    estimating: DiagnosisSettings
    settings: Settings
    in_air: bool = False


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    made = run(cfg, out)
    if verdict_in(out / DIAGNOSIS) in (Verdict.UNKNOWN, Verdict.UNDECIDED):
        following = next_command("real-rollout", _GENTLY, "robot")
    else:
        following = next_command("sim-collect", {"sim": out / AUGMENTED}, "robot")
    closing(made, out, following)


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Diagnose the episodes that `cfg` names into `out`, unless that is done there already."""
    settings = typed(Settings, cfg)
    files = episode_files(cfg.episodes)
    tests = episode_files(cfg.test_episodes) if cfg.test_episodes else []
    robot: RobotParameters = instantiate(cfg.robot)
    present = values_of(members(cfg.sim.effects))
    physics_step = dividing_step(robot.control_period, float(cfg.sim.physics_step))
    told = Told(robot, present, physics_step, instantiate(cfg.diagnosis), settings)
    step = Step("diagnose", out, recorded(cfg, NOT_RECORDED), {"episodes": files, "test episodes": tests}, 0)
    return perform(step, lambda: _diagnose_to_files(files, tests, told, out))


def enough_for_diagnosis(episodes: Sequence[Episode]) -> bool:
    """Whether the episodes are long enough, one by one and together, for a diagnosis with `FEW_DATA`."""
    lengths = [len(episode) for episode in episodes]
    return sum(length for length in lengths if length >= FEW_DATA["shortest"]) >= FEW_DATA["fewest"]


def diagnose(split: Split, told: Told) -> tuple[Diagnosis, Findings]:
    """Name what is missing on one part of the recordings, and measure on the other how far that closes the gap.

    Where rollouts on the other part contradict the fit, they have the last word on the verdict, and what is named in
    the findings falls back to the data sheet refitted.
    """
    name = name_drag if told.in_air else name_effects
    found = name(split.fitted, told.robot, told.present, candidates_for(told.robot), told.estimating, _say)
    _say("rollouts in PyBullet against held-out data")
    nominal, refitted = (_seen_by(account, split, told) for account in (found.nominal, found.refitted))
    named = refitted if found.named is found.refitted else _seen_by(found.named, split, told)
    period = told.robot.control_period
    gaps = measure_gaps(
        Models(nominal, refitted, named),
        split.kept_back,
        partial(_replay, told),
        sorted({max(1, round(horizon / period)) for horizon in told.settings.horizons}),
        Stretches(_HISTORY, 5, told.settings.starts),
        np.array([found.noise.get(name, 0.0) for name in MEASURED]),
        told.robot.wheel_radius,
    )
    diagnosis = Diagnosis(
        verdict=found.verdict,
        effects=found.effects,
        added=found.added,
        data_sheet=found.data_sheet,
        data_sheet_class=found.data_sheet_class,
        rivals=found.rivals,
        where=disagreement(found.nominal, split.fitted, told.settings.bins),
        gap=gaps,
        held_out=split.names,
        whiteness=found.whiteness,
        noise=found.noise,
        advice=found.advice,
    )
    verdict, contradiction = review(found.verdict, found.added, diagnosis.headline)
    if not contradiction:
        return diagnosis, found
    kept = diagnosis.advice if found.verdict in (Verdict.NONE, Verdict.UNKNOWN) else ()
    advice = tuple(dict.fromkeys((UNEXPLAINED, contradiction, *kept)))
    diagnosis = replace(diagnosis, verdict=verdict, effects=(), data_sheet_class=(), advice=advice)
    return diagnosis, replace(found, named=found.refitted, added=())


def augmented(present: Effects, found: Effects, physics_step: float, title: str) -> str:
    """The simulation with what was found, as yaml with a title; what does nothing is left out."""
    effects = {
        name: {key: float(value) for key, value in values.items()} for name, values in {**present, **found}.items()
    }
    text = OmegaConf.to_yaml(OmegaConf.create({"physics_step": physics_step, "effects": effects}))
    return "".join(f"# {line}\n" for line in wrap(title, 100)) + text


def _diagnose_to_files(files: Sequence[Path], tests: Sequence[Path], told: Told, out: Path) -> list[Path]:
    names = [file.stem for file in files]
    limits, present = told.settings, told.present
    usability = Usability(limits.shortest, limits.fewest, limits.fastest_turn, limits.widest_tilt)
    episodes, test_episodes = ([read_episode(file) for file in these] for these in (files, tests))
    in_air = wheels_in_air([*episodes, *test_episodes], limits.widest_tilt)
    if in_air:
        level = replace(told.estimating.tolerances, tilt_offset=0.0)
        estimating = replace(told.estimating, tolerances=level)
        sheet, acting = held(told.robot), without_rotors(present)
        told = told._replace(robot=sheet, present=acting, estimating=estimating, in_air=True)
        usability = replace(usability, fewest=limits.shortest, needs_tilt=False)
        episodes, test_episodes = ([held_upright(episode) for episode in these] for these in (episodes, test_episodes))
    recordings = read_recordings(episodes, names, told.robot, usability)
    if tests:
        few = replace(usability, fewest=limits.shortest)
        kept_back = read_recordings(test_episodes, [file.stem for file in tests], told.robot, few)
        split = Split(recordings, kept_back, tuple(recording.name for recording in kept_back), are_ends=False)
    else:
        split = held_out(recordings, told.settings.held_out)
    _say(f"{len(split.fitted)} recordings to fit, {len(split.kept_back)} held out")
    diagnosis, found = diagnose(split, told)
    more = (IN_AIR,) if in_air else _on_falls(episodes, diagnosis.verdict)
    title = _title(diagnosis, found, told.robot)
    doubtful = diagnosis.verdict in (Verdict.UNKNOWN, Verdict.UNDECIDED)
    diagnosis = replace(diagnosis, advice=(*more, *diagnosis.advice, *[f"{AUGMENTED}: {title}"] * doubtful))
    print("\n  ".join([headline_text(diagnosis), *diagnosis.advice]))
    write_diagnosis(out / DIAGNOSIS, diagnosis)
    write_atomically(out / AUGMENTED, augmented(present, found.named.effects, told.physics_step, title))
    pictures, drawn = _draw(diagnosis, out / FIGURES)
    seconds = sum(len(recording) * recording.period for recording in recordings)
    facts = [
        ("robot", told.robot.name),
        ("effects in the simulation already", ", ".join(present) or "none"),
        *_offsets(found.named, [recording.name for recording in split.fitted]),
        ("noise of the sensors, as found", ", ".join(f"{k} {v:.2g} {_UNITS[k]}" for k, v in diagnosis.noise.items())),
    ]
    setting = DiagnosisSetting(told.robot.name, names, seconds, str(out / AUGMENTED), _UNITS, facts)
    write_diagnosis_report(out / REPORT, diagnosis, setting, pictures)
    return [out / DIAGNOSIS, out / AUGMENTED, out / REPORT, *drawn]


def _say(line: str) -> None:
    """Tell what is being done."""
    print(f"  {line}", flush=True)


def _title(diagnosis: Diagnosis, found: Findings, robot: RobotParameters) -> str:
    """What an augmented simulation is."""
    content = f"the simulation of robot {robot.name} with its data sheet refitted"
    if found.added:
        content += " and " + ", ".join(found.added).replace("_", " ")
    if diagnosis.verdict in (Verdict.UNKNOWN, Verdict.UNDECIDED):
        return f"No finding (verdict {diagnosis.verdict}): {content}."
    return f"Verdict {diagnosis.verdict}: {content}."


def _on_falls(episodes: Sequence[Episode], verdict: Verdict) -> tuple[str, ...]:
    """What to do where the robot fell while it was recorded, and that was not enough to name anything."""
    fell = sum(episode.outcome is Outcome.TILT_LIMIT for episode in episodes)
    if not fell or verdict not in (Verdict.UNKNOWN, Verdict.UNDECIDED):
        return ()
    return (f"The robot fell in {fell} of {len(episodes)} episodes. One that stays up tells more: {_GENTLER}",)


def _offsets(account: Account, names: Sequence[str]) -> list[tuple[str, str]]:
    """A line on the tilt's offsets, where they were free."""
    if not account.offsets:
        return []
    told = [f"{name} {np.degrees(offset):+.1f}°" for name, offset in zip(names, account.offsets, strict=True)]
    return [("offsets of the tilt, as found", ", ".join(told))]


def _draw(diagnosis: Diagnosis, folder: Path) -> tuple[DiagnosisPictures, list[Path]]:
    """All pictures, as SVG text and as files."""
    figures = {
        "where": disagreement_figure(diagnosis.where, tuple(diagnosis.noise)),
        "rivals": rivals_figure(diagnosis.rivals, _MOST_RIVALS) if any(r.names for r in diagnosis.rivals) else None,
        "gap": gap_figure(diagnosis.gap, _UNITS, diagnosis.after) if diagnosis.gap else None,
        "whiteness": whiteness_figure(diagnosis.whiteness, diagnosis.after),
    }
    texts = {name: None if figure is None else svg(figure) for name, figure in figures.items()}
    files = []
    for name, text in texts.items():
        if text is not None:
            files.append(folder / f"{name}.svg")
            write_atomically(files[-1], text)
    return DiagnosisPictures(texts["where"] or "", texts["rivals"], texts["gap"], texts["whiteness"] or ""), files


def _seen_by(account: Account, split: Split, told: Told) -> Account:
    """What a fitted model makes of what was kept back; other recordings have tilt offsets of their own."""
    estimating, recordings = told.estimating, split.kept_back
    offsets = account.offsets if split.are_ends else tilt_offsets(estimating.tolerances, len(recordings))
    return take_account(
        told.robot, account.effects, account.noise, account.angle_lead, recordings, estimating.substeps, offsets
    )


def _replay(told: Told, account: Account, starts: Sequence[ReplayStart], commands: Array) -> Array:
    return replay(told.robot, effects_from(account.effects), told.physics_step, starts, commands)
