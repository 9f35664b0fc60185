"""Tables of latencies, from the results of this benchmark."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

from benchmarks.latency.figures import EDGES_MS

_HOSTS = {
    "real_time": "on the host, real-time priority",
    "ordinary": "on the host, without",
    "on_board": "on board; the host is halted for 1 s every 10 s",
}
_LINES = {
    "pty": "a pseudo-terminal alone, there and back",
    "pty_first": "the same, with Linux's worker threads before ordinary programs",
    "socket": "a socket alone, there and back",
}
_SHARES = "| within 2 ms | within 5 ms | median | 99 % | 99.9 % | longest |"
_ASKED = (
    ("real_time", 8, 100, "within_5_ms", 99.0, "load of 8, 100 Hz, real-time priority: 99 % within 5 ms"),
    ("real_time", 0, 100, "within_2_ms", 99.9, "alone, 100 Hz, real-time priority: 99.9 % within 2 ms"),
)


def latency(results: Mapping[str, Any]) -> list[str]:
    """One line a case: by what it is driven, how often a second, beside how many programs."""
    lines = [
        f"| policy | Hz | load {_SHARES} late | falls | withheld |",
        "|---" * 12 + "|",
    ]
    for case in sorted(_driven(results), key=_order):
        asked, found = case["settings"], case["result"]
        by = f"| {_HOSTS[asked['host']]} | {asked['rate']} | {asked['load'] or 'none'} "
        late = f"{found['late']} of {found['commands']}"
        lines.append(f"{by}{_said(found)} {late} | {_falls(found)} | {_withheld(found)} |")
    return [*lines, "", _where(results)]


def line_alone(results: Mapping[str, Any]) -> list[str]:
    """One line for each line and load."""
    lines = [f"| line | load {_SHARES}", "|---" * 8 + "|"]
    for case in results["cases"]:
        if "line" in case["settings"]:
            asked = case["settings"]
            lines.append(f"| {_LINES[asked['line']]} | {asked['load'] or 'none'} {_said(case['result'])}")
    return [*lines, "", _where(results)]


def latency_histogram(results: Mapping[str, Any]) -> list[str]:
    """Shares of the commands between two times, one line a case of a policy on the host."""
    edges = [f"{edge:g}" for edge in EDGES_MS]
    heads = [*(f"{low} to {high}" for low, high in pairwise(edges)), f"over {edges[-1]}"]
    lines = [f"| ms, per cent of the commands | {' | '.join(heads)} |", "|---" * (1 + len(heads)) + "|"]
    for case in sorted(_driven(results), key=_order):
        asked, counts = case["settings"], case["result"]["histogram"]
        if asked["host"] != "on_board":
            shares = [f"{100.0 * count / sum(counts):.2f}" if count else "-" for count in counts]
            name = f"{asked['rate']} Hz, load {asked['load'] or 'none'}, {_HOSTS[asked['host']].split(', ')[1]}"
            lines.append(f"| {name} | {' | '.join(shares)} |")
    return lines


def latency_asked(results: Mapping[str, Any]) -> list[str]:
    """What was asked for, and what was found."""
    lines = ["| asked | found |", "|---|---|"]
    cases = list(_driven(results))
    for host, load, rate, share, least, words in _ASKED:
        found = [case["result"] for case in cases if _is(case, host, load, rate)]
        lines += [f"| {words} | {each[share]:.2f} %: {_met(each[share] >= least)} |" for each in found]
    held = [case["result"] for case in cases if _is(case, "real_time", 8, 100)]
    lines += [
        f"| load of 8, 100 Hz, real-time priority: no fall | {_fell([each])}: {_met(not each['falls'])} |"
        for each in held
    ]
    board = [case["result"] for case in cases if case["settings"]["host"] == "on_board"]
    if board:
        falls = sum(each["falls"] for each in board)
        lines.append(f"| policy on board, all rates and loads: no fall | {_fell(board)}: {_met(not falls)} |")
    return lines


def keys(results: Mapping[str, Any]) -> list[str]:
    """One line for each kind of input."""
    lines = ["| input | times | median | 90 % | worst | not answered |", "|---|---|---|---|---|---|"]
    for case in results["cases"]:
        if "by" in case["settings"]:
            found, said = case["result"], case["result"]["percentiles_ms"]
            name = {"keyboard": "keys w and s", "gamepad": "stick of a gamepad"}[case["settings"]["by"]]
            times = f"{found['presses']} | {said['50']:.1f} ms | {said['90']:.1f} ms | {found['longest_ms']:.1f} ms"
            lines.append(f"| {name} | {times} | {found['unanswered']} |")
    return [*lines, "", _where(results)]


def losses(results: Mapping[str, Any]) -> list[str]:
    """One line for each way in which input is lost."""
    lines = [
        "| what is lost | at | what the log says | noticed | reference at rest | motors off | outcome, exit code |",
        "|---|---|---|---|---|---|---|",
    ]
    for case in results["cases"]:
        if "loss" in case["settings"]:
            found = case["result"]
            off = _seconds(found["motors_off"]) if found["ends"] else "no, the drive goes on"
            times = f"{_seconds(found['noticed'])} | {_seconds(found['at_rest'])} | {off}"
            ended = f"{found['outcome'].replace('_', ' ')}, {found['exit_code']}"
            said = found["events"][0] if found["events"] else "-"
            lines.append(f"| {case['settings']['loss']} | {found['speed']:.2f} m/s | {said} | {times} | {ended} |")
    return [*lines, "", _where(results)]


def viewed(results: Mapping[str, Any]) -> list[str]:
    """One line for each kind of live view."""
    names = {"none": "none", "recording": "recorded (`view=file`)", "stalled": "recorded, its process stopped"}
    lines = [f"| live view {_SHARES} late |", "|---" * 9 + "|"]
    for case in results["cases"]:
        if "view" in case["settings"]:
            found = case["result"]
            lines.append(f"| {names[case['settings']['view']]} {_said(found)} {found['late']} of {found['commands']} |")
    return [*lines, "", _where(results)]


def _driven(results: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """The cases in which a robot was driven; of those that differ in time alone, the longest."""
    longest: dict[tuple[object, ...], Mapping[str, Any]] = {}
    for case in sorted(results["cases"], key=lambda case: float(case["settings"].get("seconds", 0.0))):
        if "host" in case["settings"]:
            longest[_order(case)] = case
    yield from longest.values()


def _order(case: Mapping[str, Any]) -> tuple[int, int, int]:
    asked = case["settings"]
    return list(_HOSTS).index(asked["host"]), asked["load"], asked["rate"]


def _is(case: Mapping[str, Any], host: str, load: int, rate: int) -> bool:
    asked = case["settings"]
    return (asked["host"], asked["load"], asked["rate"]) == (host, load, rate)


def _said(found: Mapping[str, Any]) -> str:
    shares = f"| {found['within_2_ms']:.2f} % | {found['within_5_ms']:.2f} % "
    times = [*(found["percentiles_ms"][rank] for rank in ("50", "99", "99.9")), found["longest_ms"]]
    return shares + "".join(f"| {time:.1f} ms " for time in times) + "|"


def _withheld(found: Mapping[str, Any]) -> str:
    return "-" if found.get("withheld") is None else f"{found['withheld']:.1f} %"


def _falls(found: Mapping[str, Any]) -> str:
    if not found["falls"]:
        return f"none in {found['seconds']:.0f} s"
    return f"{found['falls']} in {found['seconds']:.0f} s, the first after {found['first_fall']:.1f} s"


def _fell(found: Sequence[Mapping[str, Any]]) -> str:
    return f"{sum(each['falls'] for each in found)} falls in {sum(each['seconds'] for each in found):.0f} s"


def _met(is_met: bool) -> str:
    return "met" if is_met else "**missed**"


def _seconds(time: float | None) -> str:
    if time is None:
        return "-"
    return f"{1e3 * time:.0f} ms" if time < 0.1 else f"{time:.2f} s"


def _where(results: Mapping[str, Any]) -> str:
    return f"{results['machine']}, {results['date']}."
