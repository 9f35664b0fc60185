"""Algorithm 1 from start to end: simulator, model, policy, robot, correction, better policy."""

import shlex
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.algorithm.iteration import DiagnosisOutcome
from twbal.algorithm.iteration_findings import Measures, findings, summarise
from twbal.algorithm.learned import RunResult
from twbal.algorithm.learning import Algorithm
from twbal.algorithm.outcome import rule_in_words, summary_table
from twbal.algorithm.settings import AlgorithmSettings, InitialPolicy, ModelUpdate, RolloutSettings
from twbal.algorithm.summary import Summary, read_summary
from twbal.cli.artefacts import POLICY, agent_file, read_logs
from twbal.cli.chain import Chain
from twbal.cli.commands import text
from twbal.cli.console import configuration_flags, last_of_each, next_command, run_folder
from twbal.cli.known_robot import distribution_file, known_robot
from twbal.cli.link_gate import HEED, SAME_ROBOT
from twbal.cli.manifest import MANIFEST, Manifest, StageWork, lying_in, perform, read_manifest, reopen
from twbal.cli.model_state import check_kernel_of
from twbal.cli.robot_link import virtual_command
from twbal.cli.script import HASHES, SCRIPT, hash_list, script
from twbal.cli.sim_files import as_given
from twbal.cli.stage_steps import StageSteps
from twbal.cli.stages.real_rollout import check_robot_is_there
from twbal.cli.trials_at_once import robots_at_once
from twbal.cli.typed_config import recorded, section, typed
from twbal.cli.virtual_robot_check import check_virtual_robot
from twbal.core.errors import ConfigError
from twbal.core.files import write_atomically
from twbal.core.json_records import write_record
from twbal.diagnosis.usability import FEW_DATA, enough_for_diagnosis
from twbal.virtual_robot.process import KeptRobots
from twbal.viz.run_figures import pictures, save
from twbal.viz.run_page import RunSetup, write_report

MORE_UPDATES = 3  # than a run had that did not balance the robot
NOT_RECORDED = (
    *SAME_ROBOT,
    f"real_rollout.{HEED}",
    "sim_collect.workers",
    "optimise_policy.workers",
    "real_rollout.workers",
)
INPUTS = ("known", "trained_agent")  # recorded by their content
SUMMARY, REPORT, FIGURES, BEST_POLICY = "summary.json", "report.html", "figures", "best_policy.pt"


def main(cfg: DictConfig) -> float | None:
    """Run the stage in Hydra's run folder.

    Returns:
        The long-term cost of the best policy: real where it was tried, else as predicted (None where it was
        not); for a sweeper to make small.
    """
    out, hydra, flags = run_folder(), HydraConfig.get(), configuration_flags()
    words = [word for word in hydra.overrides.task if not word.startswith("hydra.")]
    known_robot(cfg)  # what cannot be used is refused before any work, and any word of going on
    _check_agent(cfg)
    _check_updates(cfg)
    check_virtual_robot(cfg)
    again = f"If this run is interrupted, this command resumes it: {_again(flags, words, out)}"
    print(f"{again}\n", flush=True)
    try:
        run(cfg, out, hydra.runtime.choices, flags)
    except KeyboardInterrupt:
        print(f"\n{again}", flush=True)  # once more, as it is far up by now
        raise
    summary = read_summary(out / SUMMARY)
    print(f"\n{rule_in_words(instantiate(cfg.success), cfg.robot.control_period)}")
    print(f"\n{summary_table(summary)}\n")
    print(f"policy  {out / BEST_POLICY}")
    print(f"report  {out / REPORT}")
    print(f"script  {out / SCRIPT} (runs the same stages one by one)")
    for command in _following(summary, out, flags, words, cfg.updates):
        print(f"next    {command}")
    best = summary.best
    return best.predicted_cost if best.real_cost is None else best.real_cost


def _check_agent(cfg: DictConfig) -> None:
    """Raise ConfigError where an agent is given that nothing would use, or that is not there."""
    if cfg.trained_agent is not None and cfg.initial_policy != InitialPolicy.AGENT:
        raise ConfigError(
            f"trained_agent=... is an agent for policy 0, which here comes from initial_policy={cfg.initial_policy} "
            f"(method={cfg.method}). Leave trained_agent=... out, or choose initial_policy=agent."
        )
    agent_file(cfg.trained_agent)


def _check_updates(cfg: DictConfig) -> None:
    """Raise ConfigError where updates would search from a policy that no search can begin with."""
    is_fixed = cfg.initial_policy in (InitialPolicy.LQR, InitialPolicy.AGENT)
    if is_fixed and cfg.updates and cfg.model_update != ModelUpdate.LINEAR:
        raise ConfigError(
            f"Policy 0 of initial_policy={cfg.initial_policy} is none that a search can begin with; expected is "
            "updates=0 (or method=lqr_identified, whose updates are regulators). To search a policy on top of the "
            "regulator, choose method=on_lqr."
        )


def _again(flags: Sequence[str], words: Sequence[str], out: Path) -> str:
    """The command that goes on in `out`."""
    return shlex.join(["twbal", "iterate", *flags, *last_of_each(as_given(words)), f"hydra.run.dir={text(str(out))}"])


def _following(summary: Summary, out: Path, flags: Sequence[str], words: Sequence[str], updates: int) -> list[str]:
    """What to do next: drive the robot that is balanced, or learn more about the one that is not."""
    if summary.solved or not summary.best.trials:
        return [next_command("real-rollout", {"policy.path": out / BEST_POLICY}, "robot", "state", "link")]
    if updates:
        others = [word for word in words if not word.startswith("updates=")]
        commands = [_again(flags, [*others, f"updates={updates + MORE_UPDATES}"], out)]
    else:
        others = [word for word in words if not word.startswith(("updates=", "method=", "trained_agent="))]
        commands = [shlex.join(["twbal", "iterate", *flags, *last_of_each(as_given(others))])]
    folders = _to_diagnose(summary, out)
    if folders:
        commands.append(next_command("diagnose", {"episodes": folders, **FEW_DATA._asdict()}, "robot", "sim"))
    return commands


def _to_diagnose(summary: Summary, out: Path) -> list[str]:
    """Run folders whose episodes are enough for a diagnosis; none where there are not, or one was made already."""
    if any(iteration.diagnosis not in (None, DiagnosisOutcome.NOT_MADE) for iteration in summary.iterations):
        return []
    places = [out / f"iteration_{iteration.index}" for iteration in summary.iterations]
    rollouts = [rollout for place in places for rollout in sorted(place.glob("rollout*"))]
    trials = [trials for place in places if (trials := place / "trials").is_dir()]  # a policy that stays has none
    for folders in (rollouts, [*rollouts, *trials]):
        if enough_for_diagnosis(read_logs(folders)):
            return [str(folder) for folder in folders]
    return []


def run(cfg: DictConfig, out: Path, choices: Mapping[str, str], flags: Sequence[str]) -> Manifest:
    """Run Algorithm 1 as `cfg` says in `out`, or what of it is not there yet.

    Args:
        cfg: of this stage.
        out: the run folder.
        choices: which choice `cfg` has of each group.
        flags: of Hydra's with which each stage would be run by hand.

    Raises:
        TwbalError: a step failed; the message names it. The same command again goes on from there.
    """
    settings = typed(AlgorithmSettings, cfg)
    known, agent = distribution_file(cfg.known), agent_file(settings.trained_agent)
    inputs = {"known": [known] if known else [], "trained_agent": [agent] if agent else []}
    step = StageWork("iterate", out, recorded(cfg, (*NOT_RECORDED, *INPUTS)), inputs, settings.seed)
    reopen(step, lambda before: _may_go_on(before, cfg, out))
    with KeptRobots() as robots:
        chain = Chain(cfg, choices, out, flags, robots.launch)
        return perform(step, lambda: _learn_and_write(cfg, chain, choices, settings, robots))


def _may_go_on(before: Manifest, cfg: DictConfig, out: Path) -> bool:
    """Whether all that a run made is true of `cfg`, too.

    It may have had fewer updates; and another link, if it ended before a robot was driven.
    """
    then = OmegaConf.create(before.settings)
    assert isinstance(then, DictConfig)
    may_differ = ["updates"] if then.updates < cfg.updates else []
    may_differ += [] if before.complete or _has_driven(out) else ["link"]
    others = recorded(cfg, (*NOT_RECORDED, *INPUTS, *may_differ))
    return before.settings != recorded(cfg, (*NOT_RECORDED, *INPUTS)) and recorded(then, may_differ) == others


def _has_driven(out: Path) -> bool:
    """Whether a robot was driven in a run folder; of one that could not be reached there is a manifest alone."""
    folders = [path.parent for path in out.rglob(MANIFEST)]
    driven = [each for each in folders if (made := read_manifest(each)) and made.stage == "real-rollout"]
    return any(map(lying_in, driven))


def _learn_and_write(
    cfg: DictConfig, chain: Chain, choices: Mapping[str, str], settings: AlgorithmSettings, robots: KeptRobots
) -> list[Path]:
    measures = Measures(instantiate(cfg.success), instantiate(cfg.cost), cfg.search.horizon, instantiate(cfg.state))
    check_robot_is_there(cfg)
    check_kernel_of(cfg)
    steps = StageSteps(chain, cfg, robots)
    algorithm = Algorithm(steps, settings, typed(RolloutSettings, section(cfg, "real_rollout")), measures.rule)
    if "overrides" in cfg.link and settings.trials and not (chain.root / "iteration_0").exists():
        count = robots_at_once(cfg.link, settings.trials, cfg.real_rollout.workers)
        robots.begin(virtual_command(cfg.link), count)  # they start while policy 0 is found
    result = algorithm.run()
    return _write(cfg, chain, steps, result, measures, choices)


def _write(
    cfg: DictConfig,
    chain: Chain,
    steps: StageSteps,
    result: RunResult[Path, Path, Path],
    measures: Measures,
    choices: Mapping[str, str],
) -> list[Path]:
    """Write down what came out; returns the files."""
    out, found = chain.root, findings(result, steps, measures)
    simulated = steps.episodes(result.simulated)
    wall_s = round(chain.wall_s, 3)
    summary = summarise(found, simulated, cfg.robot.name, cfg.seed, wall_s, measures.rule, cfg.oscillation_limit)
    best = result.policies[summary.best_iteration].policy / POLICY
    shutil.copyfile(out / best, out / BEST_POLICY)
    commands = script(chain.commands, best, BEST_POLICY)
    write_atomically(out / SCRIPT, commands)
    write_atomically(out / HASHES, hash_list({**chain.outputs, BEST_POLICY: summary.best.policy.sha256}))
    write_record(out / SUMMARY, summary)
    drawn = pictures(summary, found, measures, cfg.robot.control_period)
    write_report(out / REPORT, summary, _setting(cfg, measures, choices), drawn, commands)
    return [*(out / name for name in (SUMMARY, BEST_POLICY, SCRIPT, HASHES, REPORT)), *save(drawn, out / FIGURES)]


def _setting(cfg: DictConfig, measures: Measures, choices: Mapping[str, str]) -> RunSetup:
    """What a reader of the report must know of the set-up."""
    channels = measures.channels
    widths = [
        f"{name} {width:g} {unit}"
        for name, width, unit in zip(channels.names, measures.cost.widths, channels.units, strict=True)
        if width < float("inf")
    ]
    virtual = "port" not in cfg.link
    facts = [
        ("method", str(cfg.method)),
        ("state", ", ".join(channels.names)),
        ("cost widths", ", ".join(widths)),
        ("horizon", f"{measures.horizon} control periods"),
        (
            "policy",
            f"{cfg.parametrisation.basis} basis functions{', and a linear part' if cfg.parametrisation.linear else ''}",
        ),
        ("link", _link_in_words(cfg.link, choices["link"])),
    ]
    if cfg.initial_policy == "simulation":
        facts.append(("simulated robots", ", ".join([str(choices.get("sim", "own")), *map(str, cfg.ensemble)])))
    return RunSetup(virtual, measures.rule, cfg.robot.control_period, [str(name) for name in cfg.ensemble], facts)


def _link_in_words(link: DictConfig, choice: str) -> str:
    """Which robot, and where its policy runs."""
    robot = f", robot {link.seed}" if "seed" in link else ""
    return f"{choice}{robot}{', policy on board' if link.get('on_board', False) else ''}"
