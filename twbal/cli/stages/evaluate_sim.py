"""Compare how well simulations predict logs."""

from collections.abc import Sequence
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.cli.artefacts import DISTRIBUTION, EVALUATION, episode_files
from twbal.cli.console import next_command, print_result, run_folder, say, say_link
from twbal.cli.evaluation_config import simulation_files, simulations_of
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.recorded_period import take_recorded_period, virtual_robot_at
from twbal.cli.sim_files import IDENTIFIED
from twbal.cli.typed_config import recorded, typed
from twbal.core.files import file_hash, write_atomically
from twbal.core.json_records import read_record, write_record
from twbal.core.robot_parameters import RobotParameters
from twbal.core.text import aligned
from twbal.diagnosis.evaluation_inputs import EvaluationSettings, GivenLog, GivenSimulation
from twbal.diagnosis.evaluation_record import EvaluatedSimulation, SimulationEvaluation
from twbal.diagnosis.log_names import distinct_names
from twbal.diagnosis.simulation_evaluation import evaluate_simulations
from twbal.io.logs import read_episode
from twbal.viz.canvas import svg
from twbal.viz.evaluation_figure import evaluation_figure
from twbal.viz.evaluation_text import (
    OWN,
    angle_channels,
    best_simulation,
    found_on_tested_on,
    judgements,
    pool,
    title,
    write_evaluation_report,
)

NOT_RECORDED = ("episodes", "sims")
NONE_SURELY_BETTER = (
    "none is better than {} by more than chance may make it in these logs, so the next command has that one; "
    "short logs cannot tell: give more of them, or longer ones"
)
ALONE = "No other simulation stands beside it; name some by sims=[...]."
REPORT, FIGURE = "report.html", "figures/evaluation.svg"


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    take_recorded_period(cfg, "evaluate-sim", episode_files(cfg.episodes))
    made = run(cfg, out)
    evaluation = read_record(SimulationEvaluation, out / EVALUATION)
    best = best_simulation(evaluation)
    if best is None and len(evaluation.simulations) > 1:
        say(NONE_SURELY_BETTER.format(evaluation.reference))
    print_result(made, out, _following(cfg, best))


def _following(cfg: DictConfig, best: EvaluatedSimulation | None) -> str:
    """The next command: learn with the best simulation; an identified one has the robot's distribution beside it."""
    if best is None:
        return next_command("sim-collect", {}, "robot", "sim")
    source = best.source.removeprefix("sim=")
    known = Path(source).parent
    if Path(source).name == IDENTIFIED and (known / DISTRIBUTION).is_file():
        robot = virtual_robot_at(cfg.robot.control_period)
        following = next_command("iterate", {"sim": source, "known": known, **robot}, "robot")
        say_link("learns on", following)
        return following
    return next_command("sim-collect", {"sim": source}, "robot")


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Evaluate the simulations on the episodes that `cfg` names into `out`, unless that is done there already."""
    files, simulations, robot = episode_files(cfg.episodes), simulations_of(cfg), instantiate(cfg.robot)
    settings = typed(EvaluationSettings, cfg)
    names = OmegaConf.to_yaml(
        OmegaConf.create({"simulations": {each.name: dict(each.effects) for each in simulations}})
    )
    inputs = {"episodes": files, "simulations": simulation_files(simulations)}
    step = StageWork("evaluate-sim", out, f"{recorded(cfg, NOT_RECORDED)}{names}", inputs, settings.seed)
    return perform(step, lambda: _evaluate_to_files(files, simulations, robot, settings, out))


def _evaluate_to_files(
    files: Sequence[Path],
    simulations: Sequence[GivenSimulation],
    robot: RobotParameters,
    settings: EvaluationSettings,
    out: Path,
) -> list[Path]:
    logs = [
        GivenLog(name, str(file), file_hash(file), read_episode(file))
        for name, file in zip(distinct_names(files), files, strict=True)
    ]
    evaluation = evaluate_simulations(simulations, logs, robot, settings, say)
    _print(evaluation)
    write_record(out / EVALUATION, evaluation)
    picture = svg(evaluation_figure(evaluation, pool(evaluation)))
    write_atomically(out / FIGURE, picture)
    write_evaluation_report(out / REPORT, evaluation, picture)
    return [out / EVALUATION, out / REPORT, out / FIGURE]


def _print(evaluation: SimulationEvaluation) -> None:
    horizon = evaluation.headline_horizon
    for channel in angle_channels(evaluation):
        print(f"{title(channel, horizon)}, 95 % interval, and times that of {evaluation.reference}")
        print(*aligned(found_on_tested_on(evaluation, channel, horizon)), sep="\n")
    if any(score.is_own_data for score in evaluation.scores):
        print(f"{OWN} the simulation was found on this log")
    for line in (*judgements(evaluation), *([ALONE] if len(evaluation.simulations) == 1 else ())):
        print(line, flush=True)
