"""Tables of the checks of imported logs, from their results."""

import textwrap
from collections.abc import Mapping
from typing import Any


def import_checks(results: Mapping[str, Any]) -> list[str]:
    """One line for logs that are right, one each for how they are so, a kind of fault, and a kind of second call."""
    said = [log for log in results["logs"] if log["said"]]
    lines = [
        "| logs | number | warned of | named as what it is | neither, but said that it cannot be told |",
        "|---" * 5 + "|",
    ]
    lines.append(f"| right ones | {len(results['logs'])} | {len(said)} | | |")
    for name in dict.fromkeys(case["convention"] for case in results["conventions"]):
        cases = [case for case in results["conventions"] if case["convention"] == name]
        lines.append(f"| right ones, {name} | {len(cases)} | {sum(bool(case['said']) for case in cases)} | | |")
    for name in dict.fromkeys(case["fault"] for case in results["faults"]):
        cases = [case for case in results["faults"] if case["fault"] == name]
        found, named = (sum(case[key] for case in cases) for key in ("found", "named"))
        untold = sum(not case["found"] and bool(case["untold"]) for case in cases)
        lines.append(f"| {name} | {len(cases)} | {found} | {named} | {untold} |")
    for what in dict.fromkeys(case["what"] for case in results["again"]):
        cases = [case for case in results["again"] if case["what"] == what]
        found = sum(bool(case["said"]) for case in cases)
        lines.append(f"| a second call: {what} | {len(cases)} | {found} | | |")
    return lines


def import_misses(results: Mapping[str, Any]) -> list[str]:
    """One entry a false warning, and one a fault that was missed or taken for another."""
    entries = [f"robot {log['seed']}, nothing wrong: {_quoted(log)}" for log in results["logs"] if log["said"]]
    for case in results["conventions"]:
        if case["said"]:
            entries.append(f"robot {case['seed']}, {case['convention']}: {_quoted(case)}")
        elif case["off"] > 1.0:
            entries.append(
                f"robot {case['seed']}, {case['convention']}: {case['off']:.3g} times as far off as is right"
            )
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


def _quoted(case: Mapping[str, Any]) -> str:
    return "; ".join(f'"{said.partition(": ")[2].partition(":")[0]}"' for said in case["said"])
