"""Tables of the benchmarks of speed, from their results."""

from collections.abc import Callable, Mapping
from statistics import median
from typing import Any

_OPTIONAL = {"steps_by_pairs": "d", "pairs_cpu_s": ".3f", "cost_error": ".0e", "gradient_error": ".0e"}


def times(results: Mapping[str, Any]) -> list[str]:
    """One line a case of the moment matching."""
    names = "engine, policy, samples, f's variance, CPU s, steps by pairs, all by pairs, cost off, gradient off, memory"
    lines = [f"| {names.replace(', ', ' | ')} |", "|" + "---|" * 10]
    for case in results["cases"]:
        s, r = case["settings"], case["result"]
        engine = "torchrl" if case["module"].endswith("peer") else "twbal"
        kept = "kept" if engine == "torchrl" or s["keep_variance"] else "dropped"
        samples = f"{s['n']} + {s['difference']}" if s.get("difference") else f"{s['n']}"
        optional = [f"{r[k]:{form}}" if k in r else "-" for k, form in _OPTIONAL.items()]
        lines.append(
            f"| {engine} | {s['policy']} | {samples} | {kept} | {r['cpu_s']:.3f} | {' | '.join(optional)} "
            f"| {r['memory_mb']:.0f} MB |"
        )
    return [*lines, "", where(results)]


def ratios(results: Mapping[str, Any]) -> list[str]:
    """How many times faster than the peer, whose time does not depend on the policy."""
    ours = {(c["settings"]["n"], c["settings"]["policy"]): c["result"]["cpu_s"] for c in with_variance(results)}
    lines = ["| samples | torchrl, CPU s | times faster: found policy | random policy |", "|---|---|---|---|"]
    for case in results["cases"]:
        if case["module"].endswith("peer"):
            n, seconds = case["settings"]["n"], case["result"]["cpu_s"]
            faster = [f"{seconds / ours[n, policy]:.0f}" for policy in ("found", "random")]
            lines.append(f"| {n} | {seconds:.2f} | {' | '.join(faster)} |")
    return lines


def with_variance(results: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Our cases with f's variance kept, as the peer keeps it."""
    return [case for case in results["cases"] if case["settings"].get("keep_variance")]


def steps(results: Mapping[str, Any]) -> list[str]:
    """Where the time of one step goes, one line a part and one column a size."""
    found = [case["result"] for case in results["cases"]]
    lines = [f"| µs a step, samples | {' | '.join(str(r['n']) for r in found)} |", "|---|" + "---|" * len(found)]
    for name, part in _STEP_PARTS.items():
        lines.append(f"| {name} | {' | '.join(f'{part(r):.0f}' for r in found)} |")
    return [*lines, "", where(results)]


_MEASURED_PARTS = ("sums_over_points_us", "policy_forward_us", "policy_back_us", "cost_us")
_STEP_PARTS: Mapping[str, Callable[[Mapping[str, Any]], float]] = {
    "sums over f's points: weights": lambda r: r["weights_us"],
    "sums over f's points: series": lambda r: r["sums_over_points_us"] - r["weights_us"],
    "policy, forward": lambda r: r["policy_forward_us"],
    "policy, back": lambda r: r["policy_back_us"],
    "cost": lambda r: r["cost_us"],
    "small matrices, and noise of these figures": lambda r: r["step_us"] - sum(r[part] for part in _MEASURED_PARTS),
    "**all**": lambda r: r["step_us"],
    "floor of the sums over points": lambda r: r["floor_us"],
}


def fits(results: Mapping[str, Any]) -> list[str]:
    """One line a size of the fits."""
    names = "samples, data sets, twbal: CPU s, BoTorch: CPU s a fit, evidence short of BoTorch's best of 20 [nats]"
    lines = [f"| {names.replace(', ', ' | ')}, worst | what the limits cost [nats], worst |", "|" + "---|" * 6]
    for n in sorted({case["settings"]["n"] for case in results["cases"]}):
        found = [case["result"] for case in results["cases"] if case["settings"]["n"] == n]
        lines.append(
            f"| {n} | {len(found)} | {median(r['cpu_s'] for r in found):.2f} "
            f"| {median(r['botorch_cpu_s'] for r in found):.2f} | {max(r['short_by'] for r in found):+.3f} "
            f"| {max(r['limits_cost'] for r in found):.1f} |"
        )
    return [*lines, "", where(results)]


def running(results: Mapping[str, Any]) -> list[str]:
    """Plant, collection and start."""
    found = {case["module"].rpartition(".")[-1]: case["result"] for case in results["cases"]}
    plant, collection, start, logs = (found[name] for name in ("plant", "collection", "start", "logs"))
    memory = f"{logs['import_memory_mb']:.0f} MB"
    rows = [
        ("control periods a second of the plant, beside a bare PyBullet loop", f"{plant['share_of_bare']:.2f}"),
        ("`sim-collect` on two processes, times faster than on one", f"{collection['times_faster']:.2f}"),
        (
            "`import-log` of 1,000,000 rows, s (CPU s, memory)",
            f"{logs['import_s']:.1f} ({logs['import_cpu_s']:.1f}, {memory})",
        ),
        (
            "reading an episode log, over the bare protobuf decoding of its messages",
            f"{logs['read_over_bare_decode']:.2f}",
        ),
        ("`twbal --help`, CPU s (an empty Python)", f"{start['help_cpu_s']:.2f} ({start['python_cpu_s']:.2f})"),
    ]
    return ["| figure | value |", "|---|---|", *(f"| {name} | {value} |" for name, value in rows), "", where(results)]


def validation(results: Mapping[str, Any]) -> list[str]:
    """One line a size of the validation of a policy."""
    lines = ["| samples of f | of g | CPU s | by PyTorch, CPU s | costs apart |", "|---|---|---|---|---|"]
    for case in results["cases"]:
        n, found = case["settings"], case["result"]
        times = f"{found['cpu_s']:.3f} | {found['torch_cpu_s']:.2f}"
        lines.append(f"| {n['f']} | {n['g']} | {times} | {found['gap']:.0e} |")
    return [*lines, "", where(results)]


def where(results: Mapping[str, Any]) -> str:
    """On what machine and when."""
    return f"{results['machine']}, {results['date']}."
