"""Train a model-free agent on the simulated robot."""

from dataclasses import dataclass
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.algorithm.collection import simulate
from twbal.algorithm.settings import RolloutSettings
from twbal.cli.artefacts import POLICY
from twbal.cli.console import Progress, print_result, run_folder
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.recorded_period import drive_next
from twbal.cli.simulation_config import simulation_of
from twbal.cli.typed_config import recorded, typed
from twbal.core.episode import Provenance
from twbal.core.evaluation import SuccessCriterion, judged
from twbal.environment.agent import AgentRecipe
from twbal.io.checkpoint import save_checkpoint
from twbal.policies.saved import load_policy

NOT_RECORDED = ("trials",)


@dataclass(frozen=True)
class Settings:
    """See conf/train_agent.yaml."""

    seed: int
    steps: int
    trials: int


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    manifest = run(cfg, out)
    trials = int(cfg.trials)
    if trials:
        print(f"  {successes(cfg, out / POLICY, trials)} of {trials} simulated trials succeed")
    print_result(manifest, out, drive_next(out / POLICY, cfg.robot.control_period))


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Train the agent that `cfg` asks for into `out`/policy.pt, unless it is there already."""
    settings = typed(Settings, cfg)
    recipe: AgentRecipe = instantiate(cfg.agent)
    step = StageWork("train-agent", out, recorded(cfg, NOT_RECORDED), {}, settings.seed)
    return perform(step, lambda: [_trained(cfg, recipe, settings, out / POLICY)])


def successes(cfg: DictConfig, policy: Path, trials: int) -> int:
    """In how many simulated trials the policy balances, by the rule of `cfg`; trial k is that of `sim-collect`."""
    rule: SuccessCriterion = instantiate(cfg.success)
    channels, seed = instantiate(cfg.state), int(cfg.seed)
    rollouts = RolloutSettings(seed, trials, 0, rule.steps, rule.tilt_limit, exploration=0.0)
    source = Provenance(str(cfg.robot.name), "simulation", seed=seed)
    driven = simulate(simulation_of(cfg), load_policy(policy, channels.names), channels, rollouts, source)
    return sum(judged(episode, rule).succeeded for episode in driven)


def _trained(cfg: DictConfig, recipe: AgentRecipe, settings: Settings, path: Path) -> Path:
    # Imported here: `iterate` has this stage among its own, and must run without the extra [rl].
    from twbal.cli.environment_config import environment_of
    from twbal.environment.agent_training import policy_of, train

    progress = Progress("steps", settings.steps)
    rule: SuccessCriterion = instantiate(cfg.success)
    with environment_of(cfg) as env:

        def show(steps: int, mean_return: float | None) -> None:
            seen = "" if mean_return is None else f", return {mean_return:.0f} of {rule.steps}"
            progress.show(min(steps, settings.steps), seen)

        agent = train(env, recipe, settings.steps, settings.seed, show)
        save_checkpoint(path, "policy", policy_of(agent, env, recipe).to_payload())
    return path
