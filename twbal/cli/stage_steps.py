"""The steps of Algorithm 1 as stages: each result lies in a folder within the run folder."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from twbal.algorithm.base_evidence import read_base_evidence
from twbal.algorithm.iteration import PolicyFile
from twbal.algorithm.prediction import Prediction, load_prediction
from twbal.algorithm.steps import (
    AS_CONFIGURED,
    Conditions,
    CorrectedSimulation,
    FittedDifference,
    Identified,
    SearchInputs,
    Steps,
    Timed,
)
from twbal.cli.artefacts import DIAGNOSIS, DISTRIBUTION, EVIDENCE, MODEL, POLICY, PREDICTION, agent_file, read_logs
from twbal.cli.chain import Chain, StageCall
from twbal.cli.console import say
from twbal.cli.known_robot import distribution_file
from twbal.cli.manifest import Manifest, read_manifest
from twbal.cli.robot_link import virtual_command
from twbal.cli.sim_files import AUGMENTED, IDENTIFIED
from twbal.cli.trials_at_once import robots_at_once, waits
from twbal.core.copies import begun_ahead, may_be_copied
from twbal.core.episode import Episode
from twbal.core.errors import CheckpointError, DataError
from twbal.core.files import file_hash
from twbal.diagnosis.diagnosis_file import closed_share
from twbal.diagnosis.usability import FEW_DATA, ONE_RUN_TOLERANCES
from twbal.virtual_robot.process import KeptRobots

_SAVED, _RANDOM = {"policy": "saved"}, {"policy": "random"}


class StageSteps(Steps[Path, Path, Path, Path, Path]):
    """Runs stages on a chain. All paths lie within its run folder; a policy is the folder of its checkpoint.

    Args:
        chain: runs the stages.
        cfg: of iterate, with a section for each stage.
        robots: virtual ones that the chain's stages drive.
    """

    def __init__(self, chain: Chain, cfg: DictConfig, robots: KeptRobots) -> None:
        self._chain, self._cfg, self._robots = chain, cfg, robots
        self.ensemble = [str(name) for name in cfg.ensemble]
        self.identifies = bool(cfg.robust)
        self.known = distribution_file(cfg.known)
        self.robot_waits = waits(cfg.link)

    def begun_ahead(self, work: Callable[[], object], drives: bool = False) -> AbstractContextManager[None]:
        """In a copy of this process: the same stages are asked for after it, and found in their folders."""
        return begun_ahead(work) if not drives or self._robots_are_ready() else nullcontext()

    def say(self, line: str) -> None:
        """Below the lines of the stage that was run last."""
        say(line)

    def was_driven(self, place: Path) -> bool:
        """As its folder says."""
        made = read_manifest(self._chain.root / place)
        return made is not None and made.complete

    def _robots_are_ready(self) -> bool:
        """Whether there are robots that a copy of this process can drive."""
        link = self._cfg.link
        if not (self.robot_waits and may_be_copied()):
            return False
        robots = robots_at_once(link, self._cfg.trials, self._cfg.real_rollout.workers)
        return self._robots.are_ready(virtual_command(link), robots, link.start_timeout)

    def simulate(
        self, place: Path, policy: Path | None, conditions: Conditions = AS_CONFIGURED, simulation: Path | None = None
    ) -> Path:
        """A call of sim-collect."""
        overrides = {"sim": simulation} if simulation else {}
        overrides |= self._seed("sim-collect") | conditions.given
        if "trials" in overrides:
            overrides["rollouts"] = overrides.pop("trials")
        return self._driven("sim-collect", place, policy, overrides, {})

    def simulate_variant(self, place: Path, name: str) -> Path:
        """A call of sim-collect with further effects."""
        effects = {
            f"++sim.effects.{effect!s}": OmegaConf.to_container(node, resolve=True)
            for effect, node in self._cfg.ensemble[name].items()
        }
        self._chain.run(StageCall("sim-collect", place, {**self._seed("sim-collect"), **effects}))
        return place

    def drive(self, place: Path, policy: Path | None, conditions: Conditions) -> Path:
        """A call of real-rollout."""
        overrides = {**self._seed("real-rollout"), **conditions.given}
        return self._driven("real-rollout", place, policy, overrides, _RANDOM)

    def fit_simulation(self, place: Path, rollouts: Sequence[Path]) -> Timed[Path]:
        """A call of fit-sim-gp."""
        return self._fitted("fit-sim-gp", place, {"episodes": list(rollouts)})

    def fit_difference(
        self, place: Path, bases: Sequence[Path | None], rollouts: Sequence[Path]
    ) -> Timed[FittedDifference[Path]]:
        """A call of fit-diff-gp."""
        several = len(bases) > 1
        dynamics = list(bases) if several else bases[0]
        fitted = self._fitted("fit-diff-gp", place, {"dynamics": dynamics, "episodes": list(rollouts)})
        return Timed(self.chosen(place) if several else FittedDifference(fitted.value), fitted.seconds)

    def chosen(self, place: Path) -> FittedDifference[Path]:
        """The model in a folder, and which of several bases it has."""
        found = read_base_evidence(self._chain.root / place / EVIDENCE)
        return FittedDifference(place / MODEL, found.chosen, found.totals)

    def identify(self, place: Path, rollouts: Sequence[Path]) -> Timed[Identified[Path, Path]]:
        """A call of identify."""
        made = self._chain.run(StageCall("identify", place, {"episodes": list(rollouts)}))
        return Timed(Identified(place / DISTRIBUTION, place / IDENTIFIED), made.wall_s)

    def search(self, place: Path, inputs: SearchInputs[Path, Path, Path, Path]) -> Timed[Path]:
        """A call of optimise-policy."""
        overrides: dict[str, Any] = {
            **self._seed("optimise-policy"),
            "dynamics": list(inputs.models),
            "initial_policies": [policy / POLICY for policy in inputs.earlier],
        }
        if inputs.known:
            overrides["known"] = inputs.known
        if inputs.recalibration:
            overrides |= {"optimise": False, "calibration_episodes": list(inputs.recalibration)}
        if inputs.with_margin:
            overrides["with_margin"] = True
        if inputs.set_aside:
            overrides["set_aside"] = list(inputs.set_aside)
        if inputs.base:
            overrides["residual_on"] = inputs.base / POLICY
        return Timed(place, self._chain.run(StageCall("optimise-policy", place, overrides)).wall_s)

    def regulator(self, place: Path, rollouts: Sequence[Path]) -> Timed[Path]:
        """A call of lqr."""
        return Timed(place, self._chain.run(StageCall("lqr", place, {"episodes": list(rollouts)})).wall_s)

    def agent(self, place: Path, trained: str | None) -> Timed[Path]:
        """A call of train-agent, unless there is an agent already; its folder then lies anywhere."""
        if file := agent_file(trained):
            return Timed(file.parent, 0.0)
        return Timed(place, self._chain.run(StageCall("train-agent", place, {"seed": self._cfg.seed})).wall_s)

    def diagnose(self, place: Path, rollouts: Sequence[Path]) -> CorrectedSimulation[Path]:
        """A call of diagnose."""
        overrides = {"episodes": list(rollouts), **FEW_DATA._asdict(), "next_experiment": False, "free_form": False}
        overrides |= {f"diagnosis.tolerances.{name}": value for name, value in ONE_RUN_TOLERANCES.items()}
        self._chain.run(StageCall("diagnose", place, overrides))
        return CorrectedSimulation(place / AUGMENTED, self.closed(place))

    def closed(self, diagnosis: Path) -> float:
        """Share of the gap that the diagnosis in a folder closes."""
        try:
            return closed_share(self._chain.root / diagnosis / DIAGNOSIS)
        except DataError as error:  # which would say that the rollouts are of no use
            raise CheckpointError(str(error)) from error

    def episodes(self, rollouts: Sequence[Path]) -> tuple[Episode, ...]:
        """The logs of run folders."""
        return read_logs([self._chain.root / folder for folder in rollouts])

    def prediction(self, policy: Path) -> Prediction:
        """The `prediction.pt` beside a policy."""
        return load_prediction(self._chain.root / policy / PREDICTION)

    def policy_file(self, policy: Path) -> PolicyFile:
        """The checkpoint of a policy."""
        file = policy / POLICY
        return PolicyFile(file.as_posix(), file_hash(self._chain.root / file))

    def _driven(
        self, stage: str, place: Path, policy: Path | None, overrides: dict[str, Any], at_random: dict[str, str]
    ) -> Path:
        if policy is None:
            self._chain.run(StageCall(stage, place, overrides, at_random))
        else:
            self._chain.run(StageCall(stage, place, {**overrides, "policy.path": policy / POLICY}, _SAVED))
        return place

    def _fitted(self, stage: str, place: Path, overrides: dict[str, Any]) -> Timed[Path]:
        made: Manifest = self._chain.run(StageCall(stage, place, {**self._seed(stage), **overrides}))
        return Timed(place / MODEL, made.wall_s)

    def _seed(self, stage: str) -> dict[str, Any]:
        return {"seed": self._cfg[stage.replace("-", "_")].seed}
