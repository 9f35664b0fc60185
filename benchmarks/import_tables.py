"""Tables of the checks of imported logs, from their results."""

import textwrap
from collections.abc import Mapping
from typing import Any

_TILT = 0.02  # rad by which a tilt may be off, as in `benchmarks.import_checks.other_sensors`


def import_checks(results: Mapping[str, Any]) -> list[str]:
    """One line for logs that are right, one each for how they are so, a kind of fault, and a kind of second call."""
    said = [log for log in results["logs"] if log["said"]]
    lines = [
        "| logs | number | right | warned of | named as what it is | neither, but said that it cannot be told |",
        "|---" * 6 + "|",
    ]
    lines.append(f"| right ones | {len(results['logs'])} | | {len(said)} | | |")
    for name in dict.fromkeys(case["convention"] for case in results["conventions"]):
        cases = [case for case in results["conventions"] if case["convention"] == name]
        right, warned = sum(map(_is_right, cases)), sum(bool(case["said"]) for case in cases)
        lines.append(f"| right ones, {name} | {len(cases)} | {right}/{len(cases)} | {warned} | | |")
    for name in dict.fromkeys(case["fault"] for case in results["faults"]):
        cases = [case for case in results["faults"] if case["fault"] == name]
        found, named = (sum(case[key] for case in cases) for key in ("found", "named"))
        untold = sum(not case["found"] and bool(case["untold"]) for case in cases)
        lines.append(f"| {name} | {len(cases)} | | {found} | {named} | {untold} |")
    for what in dict.fromkeys(case["what"] for case in results["again"]):
        cases = [case for case in results["again"] if case["what"] == what]
        found = sum(bool(case["said"]) for case in cases)
        lines.append(f"| a second call: {what} | {len(cases)} | | {found} | | |")
    return lines


def import_misses(results: Mapping[str, Any]) -> list[str]:
    """One entry a false warning, one an import that is further off than is right, and one a fault not named."""
    entries = [f"robot {log['seed']}, nothing wrong: {_quoted(log)}" for log in results["logs"] if log["said"]]
    for case in results["conventions"]:
        if case["said"]:
            entries.append(f"robot {case['seed']}, {case['convention']}: {_quoted(case)}")
        elif not _is_right(case):
            entries.append(f"robot {case['seed']}, {case['convention']}: {_how_far_off(case)}")
    for case in results["faults"]:
        if not case["named"]:
            untold = f"the log does not tell, as is said, {case['untold'][0].split(':')[0]}" if case["untold"] else ""
            silent = untold or "missed"
            said = f"taken for another: {_quoted(case)}" if case["found"] else silent
            entries.append(f"robot {case['seed']}, {case['what']}: {said}")
    lines = []
    for entry in entries:
        lines += textwrap.wrap(f"- {entry}.", 118, subsequent_indent="  ", break_long_words=False)
    return lines


def _is_right(case: Mapping[str, Any]) -> bool:
    """Whether what came out of a log that lacks something is right; without a result it is not."""
    return case["off"] is not None and case["off"] <= 1.0


def _how_far_off(case: Mapping[str, Any]) -> str:
    """The error of a tilt [rad], or that of rows and period as a share of what is right."""
    if "tilt" not in case["convention"]:
        return f"{case['off']:.3g} times as far off as is right"
    return f"the tilt is off by {_TILT * case['off']:.3g} rad (standard deviation); at most {_TILT:g} is right"


def _quoted(case: Mapping[str, Any]) -> str:
    return "; ".join(f'"{said.partition(": ")[2].partition(":")[0]}"' for said in case["said"])
