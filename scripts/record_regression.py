"""Record data/regression: logs, a model and a policy that `twbal regress` measures.

    python scripts/record_regression.py [folder]

A few simulated rollouts, a policy searched on the model of them, rollouts of it on the virtual robot, a model with
what these show, two rides of the simulated robot with hidden friction under excitation, and rollouts of a policy that
keeps a place. Afterwards: `twbal regress update=true`.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from twbal import load_policy, save_policy

FRICTION = "+effect@sim.effects.coulomb_friction=coulomb_friction"
ROLLING = ("state=rolling",)
NOISE = "+effect@sim.effects.sensor_noise=sensor_noise"


def twbal(stage: str, out: Path, *words: str) -> Path:
    """Run a stage into a folder, which is returned."""
    subprocess.run([sys.executable, "-m", "twbal", stage, *words, f"hydra.run.dir={out}"], check=True)
    return out


def main(folder: Path) -> None:
    """Record into `folder`."""
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        simulated = twbal("sim-collect", work / "simulated", "rollouts=12", "steps=40", NOISE, *ROLLING)
        small = ["model=sparse", "model.fit_f.settings.inducing=50"]  # a model of 200 kB
        f = twbal("fit-sim-gp", work / "f", f"episodes={simulated}", *small, *ROLLING)
        policy = twbal(
            *("optimise-policy", work / "policy", f"dynamics={f / 'model.pt'}", "search.iterations=8"),
            *(*ROLLING, "robust=none"),
        )
        driven = ["policy=saved", f"policy.path={policy / 'policy.pt'}", "exploration=0.05", "steps=60", *ROLLING]
        real = twbal("real-rollout", work / "real", *driven, "trials=4")
        held_out = twbal("real-rollout", work / "held_out", *driven, "trials=3", "first_trial=100")
        first = real / "episodes" / "trial_000.mcap"
        both = twbal("fit-diff-gp", work / "both", f"dynamics={f / 'model.pt'}", f"episodes={first}", *small, *ROLLING)
        ride = ["policy=excite", "rollouts=2", "steps=300", "tilt_limit=0.7", FRICTION, NOISE, *ROLLING]
        excited = twbal("sim-collect", work / "excited", *ride)
        keeper, placed = place_kept(work, small)
        for part in (simulated, real, held_out, excited, placed):
            shutil.rmtree(folder / part.name, ignore_errors=True)
            shutil.copytree(part / "episodes", folder / part.name)
        shutil.copy(both / "model.pt", folder / "model.pt")
        save_policy(folder / "policy.pt", load_policy(policy / "policy.pt"))  # which then tells its control period
        save_policy(folder / "placed.pt", load_policy(keeper / "policy.pt"))


def place_kept(work: Path, small: list[str]) -> tuple[Path, Path]:
    """A policy with a place to keep, and rollouts of it on a moderate virtual robot: two short ones, and a trial."""
    simulated = twbal("sim-collect", work / "simulated_place", "rollouts=12", "steps=40", NOISE)
    f = twbal("fit-sim-gp", work / "f_place", f"episodes={simulated}", *small)
    policy = twbal("optimise-policy", work / "policy_place", f"dynamics={f / 'model.pt'}", "search.iterations=8")
    robot = ["link.seed=9000", 'link.overrides=["idle_timeout=30","faults=moderate"]']
    driven = ["policy=saved", f"policy.path={policy / 'policy.pt'}", *robot]
    placed = twbal("real-rollout", work / "placed", *driven, "trials=2", "steps=100", "exploration=0.05")
    trial = twbal("real-rollout", work / "placed_trial", *driven, "steps=500", "first_trial=100")
    shutil.copytree(trial / "episodes", placed / "episodes", dirs_exist_ok=True)
    return policy, placed


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "data/regression"))
