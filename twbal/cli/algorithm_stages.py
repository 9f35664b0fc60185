"""Algorithm 1 of the paper, and what it is to be compared with, as a chain of stages.

    f from random rollouts in simulation; policy 0 from f
    repeat: drive the robot by policy i; g from all real rollouts; policy i + 1 from f + g

Beyond the paper, f is learned once more from rollouts of its own policy in simulation before the robot is touched;
policy 0 serves not only that f but those of other simulated robots too, `variants` of it; and every policy is driven in
trials that nothing is learned from. Once a policy succeeds in all of them, it is driven a few times more for the
model's sake, as it is: what the model then predicts of it is what the robot does, in bands as wide as these rollouts
ask for.

Other methods begin elsewhere (`first`) or learn something else from the robot's rollouts (`update`); what is driven,
tried and told stays the same.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from twbal.algorithm.summary import Basis, Diagnosis
from twbal.cli.chain import Call, Chain
from twbal.cli.manifest import Manifest
from twbal.cli.run_state import Learned, Learning, Lesson, Questions, Settings
from twbal.cli.stages.diagnose import AUGMENTED, FEW_DATA
from twbal.cli.stages.optimise_policy import POLICY
from twbal.core.errors import ConfigError
from twbal.core.evaluation import SuccessRule

MODEL, DIAGNOSED = "model.pt", "diagnosis"
FIRST_TRIAL = 1000
"""Number of policy 0's first trial; those of policy i begin at (i + 1) times that, apart from what is learned from."""


class Algorithm:
    """Runs Algorithm 1 on a chain.

    Args:
        chain: runs the stages.
        cfg: of iterate, with a section for each stage.
        settings: how often and how much.
        rule: how long trials are, and when the robot has fallen.
        asks: what it must know of rollouts on its way.
    """

    def __init__(self, chain: Chain, cfg: DictConfig, settings: Settings, rule: SuccessRule, asks: Questions) -> None:
        self._chain, self._cfg, self._settings, self._rule, self._asks = chain, cfg, settings, rule, asks
        self._firsts: Mapping[str, Callable[[], tuple[tuple[Path, ...], Learned]]] = {
            "simulation": self._simulation,
            "random": self._random,
            "regulator": self._regulator,
            "agent": self._agent,
        }
        self._lessons: Mapping[str, Callable[[Lesson], Learned]] = {
            "difference": self._difference,
            "whole": self._whole,
            "identified": self._identified,
        }
        for name in cfg.variants:  # names of folders, beside those of the rounds, which are numbers
            if not str(name).isidentifier():
                raise ConfigError(f"The name of a variant must be a word, as `late`; found {name!r}.")

    def run(self) -> Learning:
        """From nothing to the last policy."""
        simulated, first = self._firsts[self._settings.first]()
        policies = [self._tried(first)]
        while len(policies) <= self._settings.updates and not self._is_enough(policies[-1]):
            policies.append(self._tried(self._update(policies)))
        if self._settings.confirm_rollouts and policies[-1].predicted and self._is_enough(policies[-1]):
            policies.append(self._tried(self._confirmed(policies[-1])))
        return Learning(simulated, tuple(policies))

    def _simulation(self) -> tuple[tuple[Path, ...], Learned]:
        """f and its policy, and again on rollouts of that policy; the last policy serves the variants too."""
        rounds = range(self._settings.sim_rounds + 1)
        simulated: list[Path] = []
        fits: list[Manifest] = []
        searches: list[Manifest] = []
        place, last = Path("simulation"), rounds[-1]
        for i in rounds:
            simulated.append(place / f"{i}_collect")
            self._collect(simulated[-1], i, place / f"{i - 1}_policy" / POLICY)
            models = [place / f"{i}_model" / MODEL]
            fits.append(self._fit("fit-sim-gp", models[0].parent, list(simulated), {}))
            for name, effects in self._cfg.variants.items() if i == last else ():
                varied = place / f"{name}_collect"
                self._chain.run(Call("sim-collect", varied, self._varied(effects)))
                models.append(place / f"{name}_model" / MODEL)
                fits.append(self._fit("fit-sim-gp", models[-1].parent, [varied], {}))
            earlier = [place / f"{i - 1}_policy" / POLICY] if i else []
            searches.append(self._search(place / f"{i}_policy", models, earlier))
        simulated += [place / f"{name}_collect" for name in self._cfg.variants]
        f = place / f"{last}_model" / MODEL
        return tuple(simulated), Learned(
            0, tuple(fits), tuple(searches), (), place / f"{last}_policy", f, Basis.SIMULATION
        )

    def _varied(self, effects: DictConfig) -> dict[str, Any]:
        """What sim-collect is told so that the simulated robot has these effects besides."""
        told: dict[str, Any] = {"seed": self._cfg.sim_collect.seed}
        for name, effect in effects.items():
            told[f"++sim.effects.{name!s}"] = OmegaConf.to_container(effect, resolve=True)
        return told

    def _random(self) -> tuple[tuple[Path, ...], Learned]:
        """No simulation: the robot is driven at random, and all is learned from that."""
        rollout, own = Path("random") / "rollout", self._cfg.real_rollout
        told = {"seed": own.seed, "trials": self._settings.first_rollouts, "exploration": 0.0}
        self._chain.run(Call("real-rollout", rollout, told, {"policy": "random"}))
        return (), self._whole(Lesson(0, (rollout,), (), Path("iteration_0"), None, {}))

    def _regulator(self) -> tuple[tuple[Path, ...], Learned]:
        """The regulator of the data sheet; nothing is learned."""
        made = self._chain.run(Call("linear-policy", Path("regulator"), {"episodes": []}))
        return (), Learned(0, (), (made,), (), Path("regulator"), None, Basis.DATA_SHEET)

    def _agent(self) -> tuple[tuple[Path, ...], Learned]:
        """A model-free agent, trained in simulation here or before."""
        if self._settings.trained is not None:
            return (), Learned(0, (), (), (), Path(self._settings.trained).absolute(), None, Basis.AGENT)
        made = self._chain.run(Call("train-agent", Path("agent"), {"seed": self._settings.seed}))
        return (), Learned(0, (), (made,), (), Path("agent"), None, Basis.AGENT)

    def _collect(self, out: Path, round_number: int, policy: Path, simulation: Path | None = None) -> None:
        """Rollouts in simulation, as it is or by a file: at random at first, then by the policy of the round before."""
        told: dict[str, Any] = {"sim": simulation} if simulation else {}
        told["seed"] = self._cfg.sim_collect.seed
        if not round_number:
            self._chain.run(Call("sim-collect", out, told))
            return
        settings = self._settings
        told |= {
            "first_trial": FIRST_TRIAL * round_number,
            "rollouts": settings.sim_round_rollouts,
            "exploration": settings.sim_round_exploration,
            "policy.path": policy,
        }
        self._chain.run(Call("sim-collect", out, told, {"policy": "saved"}))

    def _update(self, policies: list[Learned]) -> Learned:
        """Drive the robot by the newest policy, learn g from all that was driven, and search again."""
        return self._learn_from_driving(policies[-1], [p.policy_file for p in policies], {}, {})

    def _confirmed(self, solving: Learned) -> Learned:
        """Drive the policy that solved it again and learn g again; the policy stays."""
        settings = self._settings
        bare = {"trials": settings.confirm_rollouts, "steps": settings.confirm_steps, "exploration": 0.0}
        judging = {"searches": False, "confirming": [_rollout_of(solving)]}
        learned = self._learn_from_driving(solving, [solving.policy_file], bare, judging)
        return replace(learned, confirms=True)

    def _learn_from_driving(
        self, newest: Learned, earlier: list[Path], driving: dict[str, Any], searching: dict[str, Any]
    ) -> Learned:
        """Drive the newest policy, and learn from all rollouts so far."""
        rollout = _rollout_of(newest)
        own = self._cfg.real_rollout
        first = own.first_trial + newest.index * own.trials
        self._drive(rollout, newest, {"seed": own.seed, "trials": own.trials, "first_trial": first, **driving})
        index = newest.index + 1
        place = Path(f"iteration_{index}")
        lesson = Lesson(index, (*newest.rollouts, rollout), tuple(earlier), place, newest, searching)
        return self._lessons[self._settings.update](lesson)

    def _difference(self, lesson: Lesson) -> Learned:
        """Learn g, and search (or judge) on f + g."""
        index, rollouts, _, place, newest, searching = lesson
        assert newest is not None  # f came before
        confirms = "confirming" in searching  # then the policy stays, and another f would change nothing of it
        diagnosis = Diagnosis.NOT_MADE if confirms else self._diagnosed(place, rollouts)
        if diagnosis is Diagnosis.USED:
            return self._rehearsed(lesson, place / DIAGNOSED / AUGMENTED)
        fit, search = self._corrected(lesson, place, newest.f)
        return Learned(
            index, (fit,), (search,), rollouts, place / "policy", newest.f, Basis.CORRECTED, diagnosis=diagnosis
        )

    def _corrected(self, lesson: Lesson, place: Path, f: Path | None) -> tuple[Manifest, Manifest]:
        """Learn g on top of an f, or the whole dynamics without one, and search (or judge)."""
        fit = self._fit("fit-diff-gp", place / "model", list(lesson.rollouts), {"dynamics": f})
        models, earlier = [place / "model" / MODEL], list(lesson.earlier)
        return fit, self._search(place / "policy", models, earlier, lesson.searching)

    def _rehearsed(self, lesson: Lesson, simulation: Path) -> Learned:
        """Learn f from the mended simulation, g, and a policy that balances there.

        f must say what the robot did under each of its policies, so each of them drives the new simulation, too: f says
        nothing of where no rollout has been. For the same reason the new policy rehearses there before it drives the
        robot: where it falls, f learns from how, and the search is done again.
        """
        index, rollouts, earlier, place, _, _ = lesson
        drivers, simulated = list(earlier), [place / "sim_collect"]
        self._collect(simulated[0], 0, drivers[-1], simulation)
        fits: list[Manifest] = []
        searches: list[Manifest] = []
        stands = [place, *(place / f"again_{i}" for i in range(1, self._settings.rehearsals + 1))]
        for stand in stands:
            for number in range(len(simulated), len(drivers) + 1):
                simulated.append(place / f"sim_driven_{number - 1}")
                self._collect(simulated[-1], number, drivers[number - 1], simulation)
            f, policy = stand / "sim_model" / MODEL, stand / "policy"
            fits.append(self._fit("fit-sim-gp", f.parent, list(simulated), {}))
            fit, search = self._corrected(lesson, stand, f)
            fits.append(fit)
            searches.append(search)
            drivers.append(policy / POLICY)
            if stand == stands[-1] or self._balances(stand / "rehearsal", drivers[-1], simulation):
                break
        return Learned(
            index, tuple(fits), tuple(searches), rollouts, policy, f, Basis.CORRECTED, diagnosis=Diagnosis.USED
        )

    def _balances(self, out: Path, policy: Path, simulation: Path) -> bool:
        """Whether a policy succeeds in trials in a simulation."""
        told = {"sim": simulation, "seed": self._cfg.sim_collect.seed, "policy.path": policy, **self._as_judged()}
        self._chain.run(Call("sim-collect", out, told, {"policy": "saved"}))
        return self._asks.solved(out)

    def _whole(self, lesson: Lesson) -> Learned:
        """Learn the whole dynamics, without a simulation, and search (or judge) on that."""
        index, rollouts, _, place, _, _ = lesson
        fit, search = self._corrected(lesson, place, None)
        return Learned(index, (fit,), (search,), rollouts, place / "policy", None, Basis.ROBOT)

    def _identified(self, lesson: Lesson) -> Learned:
        """Fit a linear model and make its regulator."""
        index, rollouts, _, place, _, _ = lesson
        made = self._chain.run(Call("linear-policy", place / "policy", {"episodes": list(rollouts)}))
        return Learned(index, (), (made,), rollouts, place / "policy", None, Basis.IDENTIFIED)

    def _diagnosed(self, place: Path, rollouts: Sequence[Path]) -> Diagnosis:
        """Look for what the simulation lacks, where that is asked for and there are rollouts enough.

        What was found is used if it closes the better part of the gap.
        """
        if not (self._settings.diagnose and self._asks.diagnosable(rollouts)):
            return Diagnosis.NOT_MADE
        self._chain.run(Call("diagnose", place / DIAGNOSED, {"episodes": list(rollouts), **FEW_DATA}))
        return Diagnosis.USED if self._asks.mended(place / DIAGNOSED) else Diagnosis.NOT_USED

    def _tried(self, learned: Learned) -> Learned:
        """`learned` with its trials driven."""
        settings = self._settings
        if not settings.trials:
            return learned
        trials = Path(f"iteration_{learned.index}") / "trials"
        told = {
            "seed": self._cfg.real_rollout.seed,
            "trials": settings.trials,
            "first_trial": FIRST_TRIAL * (learned.index + 1),
            **self._as_judged(),
        }
        self._drive(trials, learned, told)
        return replace(learned, trials=trials)

    def _as_judged(self) -> dict[str, Any]:
        """What a rollout is told that is to be judged by the rule."""
        return {"steps": self._rule.steps, "tilt_limit": self._rule.limit, "exploration": 0.0}

    def _drive(self, out: Path, learned: Learned, told: dict[str, object]) -> None:
        told = {**told, "policy.path": learned.policy_file}
        self._chain.run(Call("real-rollout", out, told, {"policy": "saved"}))

    def _fit(self, stage: str, out: Path, episodes: list[Path], told: dict[str, object]) -> Manifest:
        seed = self._cfg[stage.replace("-", "_")].seed
        return self._chain.run(Call(stage, out, {"seed": seed, **told, "episodes": episodes}))

    def _search(
        self, out: Path, models: list[Path], earlier: list[Path], also: dict[str, Any] | None = None
    ) -> Manifest:
        told = {"seed": self._cfg.optimise_policy.seed, "dynamics": models, "earlier": earlier, **(also or {})}
        if self._settings.on_regulator:
            self._chain.run(Call("linear-policy", Path("regulator"), {"episodes": []}))
            told["base"] = Path("regulator") / POLICY
        return self._chain.run(Call("optimise-policy", out, told))

    def _is_enough(self, learned: Learned) -> bool:
        return self._settings.stop_when_solved and learned.trials is not None and self._asks.solved(learned.trials)


def _rollout_of(learned: Learned) -> Path:
    """Run folder of the real rollouts of a policy that something is learned from."""
    return Path(f"iteration_{learned.index}") / "rollout"
