"""A run of Algorithm 1 that is whole and small."""

import sys
from pathlib import Path

OVERRIDES = [
    *(
        "updates=1",
        "stop_when_solved=false",
        "trials=2",
        "success.duration=0.4",
        "success.settle_time=0.2",
        "success.place_time=0.2",
        "real_rollout.steps=30",
        "min_update_time=0",
    ),
    *("sim_collect.rollouts=6", "sim_collect.steps=20", "sim_round_rollouts=1"),
    *("model.fit_f.settings.fit.starts=1", "model.fit_g.settings.starts=1"),
    *("model.smoothing.rounds=1", "model.smoothing.iterations=2"),
    *("search.horizon=8", "search.short_horizon=4", "search.iterations=1", "search.short_iterations=1"),
    *(
        "search.linearisation_amplitudes=[0.3]",
        "search.lqr_command_widths=[0.3]",
        "search.gain_scales=[1.0]",
        "search.restarts=1",
    ),
    *("validation.robots=3", "validation.features=20", "parametrisation.basis=4"),
]
STEPS = 15  # stages that it runs


def command(folder: Path) -> list[str]:
    """That runs it in a process of its own."""
    return [sys.executable, "-m", "twbal", "iterate", *OVERRIDES, f"hydra.run.dir={folder}"]


def listed_hashes(folder: Path) -> dict[str, str]:
    """What its artefacts.sha256 says, by path."""
    lines = (folder / "artefacts.sha256").read_text().splitlines()
    return {path: sha256 for sha256, path in (line.split("  ", 1) for line in lines)}
