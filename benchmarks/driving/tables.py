"""Tables of driving, from the results of this benchmark."""

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

_RAMPS = ("slowest", "middle", "fastest")
_UNITS = {"ramp": (" %", ".1f"), "turns": ("°", ".1f"), "square": (" m", ".3f"), "slope": (" m", ".3f")}
_ASKED = {
    "turns": "turns of 90° and 180° within 3°",
    "square": "square closed within 1 wheel radius",
    "push forward": "push forward survived",
    "push backward": "push backward survived",
    "slope up": "2° up, place kept within 2 wheel radii",
    "slope down": "2° down, place kept within 2 wheel radii",
}


def driving(results: Mapping[str, Sequence[Any]]) -> list[str]:
    """One line a task and a column a family: how many did it, what was measured, and how many fell."""
    counts = [str(len(robots)) for robots in results.values()]
    lines = [
        f"| what | {' | '.join(results)} |",
        "|---" * (1 + len(results)) + "|",
        f"| robots | {' | '.join(counts)} |",
    ]
    for number in range(len(next(iter(results.values()))[0]["tasks"])):
        by_family = [[robot["tasks"][number] for robot in robots] for robots in results.values()]
        cells = [_cell(each) for each in by_family]
        lines.append(f"| {_words(number, by_family[0][0])} | {' | '.join(cells)} |")
    return lines


def misses(results: Mapping[str, Sequence[Any]]) -> list[str]:
    """One line a robot that missed something."""
    lines = ["| robot | what it missed |", "|---|---|"]
    for family, robots in results.items():
        for robot in robots:
            missed = [_missed(task, robot.get("wheels_larger")) for task in robot["tasks"] if not task["passed"]]
            if missed:
                lines.append(f"| {family} {robot['seed']} | {'; '.join(missed)} |")
    return lines if len(lines) > 2 else ["None missed anything."]


def _words(number: int, task: Mapping[str, Any]) -> str:
    if task["name"] == "ramp":
        return f"{_RAMPS[number]} ramp, speed within 5 %"
    return _ASKED.get(task["name"]) or _ASKED[f"{task['name']} {task['choice']}"]


def _cell(tasks: Sequence[Mapping[str, Any]]) -> str:
    """Such as `0.3 m/s: 9 of 10; 1.7 / 4.6 %; 1 fell`: how many did it, median and worst, and the falls."""
    name, fell = tasks[0]["name"], sum(task["fell"] for task in tasks)
    said = [f"{sum(task['passed'] for task in tasks)} of {len(tasks)}"]
    worst = [max(map(abs, task["measured"])) for task in tasks if task["measured"]]
    if worst and name in _UNITS:
        unit, form = _UNITS[name]
        said.append(f"{median(worst):{form}} / {max(worst):{form}}{unit}")
    if fell and name != "push":
        said.append(f"{fell} fell")
    return (f"{tasks[0]['choice']}: " if name == "ramp" else "") + "; ".join(said)


def _missed(task: Mapping[str, Any], wheels_larger: float | None) -> str:
    """Such as `ramp 0.3 m/s: -6.5, -3.9 % (wheels -2.0 %)`.

    Args:
        task: with its result.
        wheels_larger: than those of the sheet, which shows in a speed [per cent]; None: not noted.
    """
    what = f"{task['name']} {task['choice']}"
    if task["fell"]:
        return f"{what}: fell after {task['seconds']:.1f} s"
    unit, form = _UNITS[task["name"]]
    wheels = f" (wheels {wheels_larger:+.1f} %)" if task["name"] == "ramp" and wheels_larger is not None else ""
    return f"{what}: {', '.join(f'{each:{form}}' for each in task['measured'])}{unit}{wheels}"
