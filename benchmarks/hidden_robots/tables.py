"""Tables of hidden robots, from the results of this benchmark."""

import json
from collections.abc import Callable, Mapping, Sequence
from math import inf
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.hidden_robots.families import FAMILIES
from benchmarks.hidden_robots.pushes import RESULTS_OF_PUSHES
from benchmarks.hidden_robots.robots import Workshop
from twbal.core.yielding import yields_to_pushes

RESULTS = Path(__file__).resolve().parent.parent / "results"
RULES = {"default": "default rule", "sticky": "sticky rule"}
COLUMNS = {**RULES, "due": "each by its own"}
_WITHIN = (0, 1, 3, 6)  # updates
_TRIALS = 10  # of each policy
_BESIDE = ("", "pilco", "lqr", "lqr_integral", "lqr_identified", "one_simulation", "paper")


def summary(results: Mapping[str, Any]) -> list[str]:
    """One line a figure of a family of hidden robots, and a column for each rule of success.

    The last column judges robots that stick by the sticky rule, and the others by the default one.
    """
    found, missing = [_with_due(robot) for robot in results["robots"]], results["unreachable"]
    sticky = sum(robot["reference"]["is_sticky"] for robot in found)
    rows = [
        ("robots", [f"{len(found)}"] * len(COLUMNS)),
        ("robots that stick", [f"{sticky}"] * len(COLUMNS)),
        *(
            (f"all trials succeed within {n} update{'s' * (n != 1)}", _by_rule(found, _solved_within, n))
            for n in _WITHIN
        ),
        ("place of the successes, median / worst", _by_rule(found, _spread, "farthest", " m", ".2f")),
        ("tilt from peak to peak, median / worst", _by_rule(found, _spread, "oscillation_deg", "°", ".1f")),
        ("the same under the reference search", [_reference(found)] * len(COLUMNS)),
        ("driven to learn, median / worst", _by_rule(found, _seconds, "real_seconds")),
        ("driven to decide, median / worst", _by_rule(found, _seconds, "trial_seconds")),
        ("robots that stand a minute, in five of five trials", _by_rule(found, _minutes)),
    ]
    rows += [(name, [cell] * len(COLUMNS)) for name, cell in _pushes(results["family"], found)]
    lines = [f"| figure | {' | '.join(COLUMNS.values())} |", "|---|---|---|---|"]
    lines += [f"| {name} | {' | '.join(cells)} |" for name, cells in rows]
    listed = ", ".join(map(str, missing)) or "none"
    return [*lines, "", f"Left out, as the reference search finds nothing that passes: {listed}."]


def _pushes(family: str, found: Sequence[Mapping[str, Any]]) -> list[tuple[str, str]]:
    """What became of pushes: the way that `twbal real-rollout` drives by default first, then the other."""
    shop = Workshop(FAMILIES[family])
    by_default = yields_to_pushes(None, shop.sheet)
    rows = []
    for name, yields in sorted(RESULTS_OF_PUSHES.items(), key=lambda each: each[1] is not by_default):
        driven = [push for robot in found for push in robot.get(name, ())]
        way = "yielding" if yields else "resisting"
        rows += _survived(driven, f"{way}, the default here" if yields is by_default else way)
    reference = _reference_pushes(family, [robot["seed"] for robot in found])
    return rows + (_survived(reference, "under the reference search") if rows else [])


def _survived(driven: Sequence[Mapping[str, bool]], way: str) -> list[tuple[str, str]]:
    """The two rows of pushes; none where there were no pushes."""
    if not driven:
        return []
    survived, back = (f"{sum(push[name] for push in driven)} of {len(driven)}" for name in ("survived", "back"))
    return [(f"pushes survived ({way})", survived), (f"and back in place within 5 s ({way})", back)]


def _reference_pushes(family: str, seeds: Sequence[int]) -> list[Mapping[str, bool]]:
    """Those of these robots under the reference search; none, unless all are known."""
    file = RESULTS / f"reference_{family}.json"
    known = json.loads(file.read_text()).get("pushes", {}) if file.exists() else {}
    if not all(str(seed) in known for seed in seeds):
        return []
    return [push for seed in seeds for push in known[str(seed)]]


def _with_due(robot: Mapping[str, Any]) -> Mapping[str, Any]:
    """A robot whose trials are judged by the rule that it is due, too."""
    rule = "sticky" if robot["reference"]["is_sticky"] else "default"

    def judged(trials: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
        return [{**trial, "due": trial[rule]} for trial in trials]

    steps = [{**step, "trials": judged(step["trials"])} for step in robot["iterations"]]
    minute = {"minute": judged(robot["minute"])} if "minute" in robot else {}
    return {**robot, "iterations": steps, **minute}


def robots(results: Mapping[str, Any]) -> list[str]:
    """One line a hidden robot."""
    names = (
        "robot, sticks, torque gain, dead zone, delay, friction, mass, COM height, COM offset, successes by update, "
    )
    names += "by the sticky rule, place [m], real s"
    lines = [f"| {names.replace(', ', ' | ')} |", "|" + "---|" * 13]
    for robot in results["robots"]:
        hidden, steps = robot["hidden"], robot["iterations"]
        places = [t["farthest"] for t in steps[robot["best"]]["trials"] if t["farthest"] is not None]
        seconds = seconds_to(robot, "default")
        by_rule = [", ".join(_said(step, rule) for step in steps) for rule in RULES]
        lines.append(
            f"| {robot['seed']} | {'yes' if robot['reference']['is_sticky'] else 'no'} | {hidden['torque_gain']:.2f} "
            f"| {hidden['dead_zone']:.2g} N·m | {hidden['delay_ms']:.0f} ms | {hidden['coulomb_friction']:.2g} N·m "
            f"| × {hidden['body_mass']:.2f} | × {hidden['com_height']:.2f} | {hidden['com_offset_deg']:+.1f}° "
            f"| {' | '.join(by_rule)} | {f'{median(places):.2f}' if places else '-'} "
            f"| {'-' if seconds is None else f'{seconds:.1f}'} |"
        )
    return lines


def beside(results: Mapping[str, Any]) -> list[str]:
    """One line a recipe that learned robots of this family: seconds of driving, learning and deciding apart."""
    lines = [
        "| recipe | robots | solved | driven to learn, median / worst | driven to decide |",
        "|---|---|---|---|---|",
    ]
    for recipe in _BESIDE:
        file = RESULTS / f"hidden_robots_{results['family']}{recipe and f'_{recipe}'}.json"
        if file.exists():
            found = json.loads(file.read_text())["robots"]
            solved = sum(solved_at(robot, "default") is not None for robot in found)
            seconds = [_seconds(found, "default", name) for name in ("real_seconds", "trial_seconds")]
            lines.append(f"| {recipe or 'default'} | {len(found)} | {solved} | {' | '.join(seconds)} |")
    return lines


def first_policies(results: Mapping[str, Any]) -> list[str]:
    """One line a figure of policy 0, from the nominal simulation and from the one that a rollout corrected."""
    corrected = results["robots"]
    nominal = json.loads((RESULTS / f"hidden_robots_{results['family']}.json").read_text())["robots"]
    by_seed = {robot["seed"]: robot for robot in nominal}
    found = [[by_seed[robot["seed"]] for robot in corrected], corrected]
    wins = [[successes(robot["iterations"][0], "default") for robot in robots] for robots in found]
    upright = [
        sum(trial["default"]["upright"] for robot in robots for trial in robot["iterations"][0]["trials"])
        for robots in found
    ]
    seconds = [robot["seconds_before"] for robot in corrected]

    def with_at_least(trials: int) -> list[str]:
        return [f"{sum(each >= trials for each in won)} of {len(won)}" for won in wins]

    missed = [f"{robot['seed']} ({won})" for robot, won in zip(corrected, wins[1], strict=True) if won < _TRIALS]
    rows = [
        ("robots on which all ten trials succeed", with_at_least(_TRIALS)),
        ("robots on which at least half of them do", with_at_least(_TRIALS // 2)),
        ("trials that succeed", [f"{sum(won)} of {_TRIALS * len(won)}" for won in wins]),
        ("trials in which the robot stays upright", [f"{count} of {_TRIALS * len(corrected)}" for count in upright]),
        ("robots on which fewer do (successes)", ["not listed", ", ".join(missed) or "none"]),
        ("length of the rollout, shortest / median", ["-", f"{min(seconds):.1f} s / {median(seconds):.1f} s"]),
    ]
    lines = ["| figure | from the data sheet | from one rollout |", "|---|---|---|"]
    return lines + [f"| {name} | {' | '.join(cells)} |" for name, cells in rows]


def three_seeds(results: Mapping[str, Any]) -> list[str]:
    """One line a recipe that learned one robot with several seeds: updates and seconds up to the first ten of ten."""
    runs, lines = results["runs"], ["| recipe | updates | driven to learn |", "|---|---|---|"]
    for recipe in dict.fromkeys(run["recipe"] for run in runs):
        solved = [
            next((step for step in run["iterations"] if step["successes"] == step["trials"]), None)
            for run in runs
            if run["recipe"] == recipe
        ]
        updates = ", ".join("never" if step is None else str(step["index"]) for step in solved)
        seconds = ", ".join("never" if step is None else f"{step['real_seconds']:.1f} s" for step in solved)
        lines.append(f"| {recipe} | {updates} | {seconds} |")
    return lines


def paper(results: Mapping[str, Any]) -> list[str]:
    """One line a robot that the paper's own recipe learned, by the paper's own rule; and whether it stands a minute."""
    lines = [
        "| robot | successes by update, of ten | driven to learn | cost predicted / real, last | stands a minute |",
        "|---|---|---|---|---|",
    ]
    for robot in results["robots"]:
        steps, minute = robot["iterations"], robot["minute"]
        last, count = steps[-1], sum(trial["default"]["succeeded"] for trial in minute)
        cost = f"{last['predicted_cost']:.1f} / {last['real_cost']:.1f}"
        by_update = ", ".join(str(step["successes"]) for step in steps)
        lines.append(
            f"| {robot['seed']} | {by_update} | {last['real_seconds']:.1f} s | {cost} | {count} of {len(minute)} |"
        )
    return lines


def reachable(results: Mapping[str, Any]) -> list[str]:
    """What the reference search alone found."""
    found = results["robots"]
    reached = [robot for robot in found.values() if robot["reachable"]]
    missing = ", ".join(seed for seed, robot in found.items() if not robot["reachable"]) or "none"
    return [
        f"{len(reached)} of {len(found)} robots are reachable, {sum(r['tried'] == 1 for r in reached)} by the first "
        f"controller. Not reachable: {missing}."
    ]


def reproduced(results: Mapping[str, Any]) -> list[str]:
    """How many runs of each family and recipe were made again by their own commands."""
    kinds: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for name, run in results.items():
        family, recipe, _ = name.split("/")
        kinds.setdefault((recipe, family), []).append(run)
    lines = ["| recipe | family | runs made again | the same bytes | artefacts |", "|---|---|---|---|---|"]
    for (recipe, family), runs in sorted(kinds.items(), key=lambda kind: (kind[0][0] != "default", kind[0])):
        same, artefacts = sum(run["same"] for run in runs), sum(run["artefacts"] for run in runs)
        lines.append(f"| {recipe} | {family} | {len(runs)} | {same} | {artefacts} |")
    return lines


def _by_rule(found: Sequence[Mapping[str, Any]], figure: Callable[..., str], *more: Any) -> list[str]:
    return [figure(found, rule, *more) for rule in COLUMNS]


def _solved_within(found: Sequence[Mapping[str, Any]], rule: str, updates: int) -> str:
    after = [solved_at(robot, rule) for robot in found]
    return f"{sum(index is not None and index <= updates for index in after)}"


def _spread(found: Sequence[Mapping[str, Any]], rule: str, name: str, unit: str, form: str) -> str:
    """Over the successful trials of each robot's best policy."""
    trials = [trial for robot in found for trial in robot["iterations"][robot["best"]]["trials"]]
    return _median_worst([trial[name] for trial in trials if trial[rule]["succeeded"]], unit, form)


def _reference(found: Sequence[Mapping[str, Any]]) -> str:
    return _median_worst([robot["reference"]["oscillation"] for robot in found], "°", ".1f")


def _seconds(found: Sequence[Mapping[str, Any]], rule: str, name: str) -> str:
    """Seconds up to the first policy all of whose trials succeed; those of robots without one are endless."""
    values = [seconds_to(robot, rule, name) for robot in found]
    return _median_worst([inf if value is None else value for value in values], " s", ".1f")


def _minutes(found: Sequence[Mapping[str, Any]], rule: str) -> str:
    driven = [robot["minute"] for robot in found if "minute" in robot]
    return f"{sum(all(trial[rule]['succeeded'] for trial in trials) for trials in driven)} of {len(driven)}"


def _median_worst(values: Sequence[float], unit: str, form: str) -> str:
    if not values:
        return "-"
    return " / ".join("never" if each == inf else f"{each:{form}}{unit}" for each in (median(values), max(values)))


def successes(iteration: Mapping[str, Any], rule: str) -> int:
    """Trials of an iteration that succeed by a rule."""
    return sum(trial[rule]["succeeded"] for trial in iteration["trials"])


def _said(iteration: Mapping[str, Any], rule: str) -> str:
    """The same as text; of a policy that was kept, and so not tested again, a dash."""
    return str(successes(iteration, rule)) if iteration["trials"] else "-"


def solved_at(robot: Mapping[str, Any], rule: str) -> int | None:
    """Updates after which all trials succeed for the first time; None where they never do."""
    steps = robot["iterations"]
    return next((s["index"] for s in steps if s["trials"] and successes(s, rule) == len(s["trials"])), None)


def seconds_to(robot: Mapping[str, Any], rule: str, name: str = "real_seconds") -> float | None:
    """Seconds for which the robot was driven up to there, to learn or (`trial_seconds`) to decide; None: never."""
    index = solved_at(robot, rule)
    if index is None:
        return None
    upto = robot["iterations"][: index + 1]
    return float(upto[-1][name] if name == "real_seconds" else sum(step[name] or 0.0 for step in upto))
