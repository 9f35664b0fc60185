"""The tables of noise and of mutated sessions, from results/link_fuzz.json."""

from collections.abc import Mapping
from typing import Any

_DECODERS = {"C++": "C++, under address and undefined-behaviour sanitizers", "Python": "Python"}


def link_noise(results: Mapping[str, Any]) -> list[str]:
    """One line a decoder."""
    lines = [
        "| decoder | random and mutated bytes | sound frames after noise | of these not heard | broken runs accepted |",
        "|---|---|---|---|---|",
    ]
    for name, found in results["decoders"].items():
        accepted = f"{found['accepted']:,} of {found['runs']:,}"
        cells = [f"{found[key]:,}" for key in ("bytes", "frames", "lost")]
        lines.append(f"| {_DECODERS[name]} | {' | '.join(cells)} | {accepted} |")
    return lines


def link_sessions(results: Mapping[str, Any]) -> list[str]:
    """What became of the sessions, as a sentence."""
    found = results["sessions"]
    return [
        f"In {found['sessions']:,} mutated sessions firmware and model were compared after each of {found['events']:,} "
        "events.",
        f"The robot was armed after {found['armed']:,} of them. They differed in {found['wrong']:,} sessions.",
    ]
