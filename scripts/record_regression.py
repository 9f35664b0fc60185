"""Record data/regression: logs, a model and a policy that `twbal regress` measures.

    python scripts/record_regression.py [folder]

A few simulated rollouts, a policy searched on the model of them, rollouts of it on the virtual robot, a model with
what these show, and two rides of the simulated robot with hidden friction under excitation. Afterwards: `twbal regress
update=true`.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

FRICTION = "+effect@sim.effects.coulomb_friction=coulomb_friction"
NOISE = "+effect@sim.effects.sensor_noise=sensor_noise"


def twbal(stage: str, out: Path, *words: str) -> Path:
    """Run a stage into a folder, which is returned."""
    subprocess.run([sys.executable, "-m", "twbal", stage, *words, f"hydra.run.dir={out}"], check=True)
    return out


def main(folder: Path) -> None:
    """Record into `folder`."""
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        simulated = twbal("sim-collect", work / "simulated", "rollouts=12", "steps=40", NOISE)
        small = ["model=sparse", "model.fit_f.settings.inducing=50"]  # a model of 200 kB
        f = twbal("fit-sim-gp", work / "f", f"episodes={simulated}", *small)
        policy = twbal("optimise-policy", work / "policy", f"dynamics={f / 'model.pt'}", "search.iterations=8")
        driven = ["policy=saved", f"policy.path={policy / 'policy.pt'}", "exploration=0.05", "steps=60"]
        real = twbal("real-rollout", work / "real", *driven, "trials=4")
        held_out = twbal("real-rollout", work / "held_out", *driven, "trials=3", "first_trial=100")
        first = real / "episodes" / "trial_000.mcap"
        both = twbal("fit-diff-gp", work / "both", f"dynamics={f / 'model.pt'}", f"episodes={first}", *small)
        ride = ["policy=excite", "rollouts=2", "steps=300", "tilt_limit=0.7", FRICTION, NOISE]
        excited = twbal("sim-collect", work / "excited", *ride)
        for part in (simulated, real, held_out, excited):
            shutil.rmtree(folder / part.name, ignore_errors=True)
            shutil.copytree(part / "episodes", folder / part.name)
        shutil.copy(both / "model.pt", folder / "model.pt")
        shutil.copy(policy / "policy.pt", folder / "policy.pt")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "data/regression"))
