"""Names of earlier versions, and what is called what now."""

from twbal.cli.settings.nested_settings import ancestors

STAGES = {"linear-policy": "lqr", "show": "plot", "check": "regress", "recover": "repair"}
"""Stages, as on the command line."""

_CREDENCE = (
    "diagnosis.credence",
    *(f"diagnosis.credence.{name}" for name in ("objected_effect", "objected_set", "incomplete_set")),
)

_COMMON = ("diagnosis.usual", "diagnosis.common_effects")

_LEAST_SCORES = (
    *("diagnosis.lines.score", "diagnosis.lines.sheet"),
    *("diagnosis.thresholds.min_score", "diagnosis.thresholds.min_data_sheet_score"),
)

SETTINGS = {
    "linear_policy": "lqr",
    "variants": "ensemble",
    "variants.late": "ensemble.latency",
    "first": "initial_policy",
    "first_rollouts": "random_rollouts",
    "update": "model_update",
    "rehearsals": "search_retries",
    "on_regulator": "on_lqr",
    "trained": "trained_agent",
    "confirm_rollouts": "calibration_rollouts",
    "confirm_steps": "calibration_steps",
    "sim_collect.tilt_limit": "tilt_limit",
    "real_rollout.tilt_limit": "tilt_limit",
    "improve_oscillation": "oscillation_limit",
    "identified_base": "base_by_evidence",
    "earlier": "initial_policies",
    "base": "residual_on",
    "confirming": "calibration_episodes",
    "searches": "optimise",
    "search.searched": "search.restarts",
    "search.content": "search.min_success_rate",
    "search.swings": "search.linearisation_amplitudes",
    "search.command_widths": "search.lqr_command_widths",
    "search.shares": "search.gain_scales",
    "judge": "validation",
    "judge.rule": "validation.success",
    "rule": "success",
    "rule.limit": "success.tilt_limit",
    "rule.settle_limit": "success.settled_tilt_limit",
    "rule.settle_step": "success.settle_time",
    "rule.steps": "success.duration",
    "success.settle_step": "success.settle_time",
    "success.steps": "success.duration",
    "shape": "parametrisation",
    "shape.past_command_scale": "parametrisation.command_scale",
    "cost.past_command_width": "cost.command_width",
    "policy.share": "policy.amplitude",
    "policy.sine": "policy.multisine",
    "policy.binary": "policy.prbs",
    "policy.tilt_limit": "policy.fade_tilt",
    "shortest": "min_length",
    "fewest": "min_samples",
    "fastest_turn": "max_yaw_rate",
    "widest_tilt": "max_tilt",
    **dict.fromkeys(_COMMON, "diagnosis.tempered_search"),
    "diagnosis.leave_out": "diagnosis.exclude",
    "diagnosis.most_effects": "diagnosis.max_effects",
    "diagnosis.lines": "diagnosis.thresholds",
    **dict.fromkeys(_LEAST_SCORES, "diagnosis.thresholds.false_alarm_probability"),
    "diagnosis.lines.share": "diagnosis.thresholds.min_gain_share",
    "diagnosis.lines.least": "diagnosis.thresholds.min_effect_size",
    "diagnosis.lines.whiteness": "diagnosis.thresholds.max_autocorrelation",
    "diagnosis.lines.discrepancy": "diagnosis.thresholds.max_discrepancy",
    "diagnosis.lines.strain": "diagnosis.thresholds.max_tolerance_statistic",
    "diagnosis.lines.shift": "diagnosis.thresholds.min_reported_shift",
    "diagnosis.lines.beyond": "diagnosis.thresholds.max_shift",
    "diagnosis.lines.steady": "diagnosis.thresholds.max_size_difference",
    "diagnosis.lines.form": "diagnosis.thresholds.form_error",
    "diagnosis.lines.margin": "diagnosis.thresholds.equivalence_margin",
    "diagnosis.best_guess": "diagnosis.prior",
    "diagnosis.apply_if_unknown": "diagnosis.prior",
    **dict.fromkeys(_CREDENCE, "diagnosis.prior"),
    "beside": "compare_with",
    "hidden": "faults",
    "hidden.lag_periods": "faults.motor_lag",
    "faults.lag_periods": "faults.motor_lag",
    "tilt_limit": "self_stop_tilt",
}
"""Settings and groups by their dotted keys; what lies under one that is not named itself has kept its name there."""

CHOICES = {
    "diagnosis": {"measured": "real_logs"},
    "ensemble": {"late": "latency"},
    "faults": {"recipe": "hard", "random": "hard"},
    "model/fit_g": {"whole": "full"},
}
"""Choices by their group, as it is called now."""

_SECTIONS = ("sim_collect", "optimise_policy", "real_rollout", "recordings", "linear_policy")  # of other stages


IN_SECONDS = ("success.duration", "success.settle_time")
"""What was in control periods under its earlier name."""


INSTEAD = (
    dict.fromkeys(
        ("diagnosis.best_guess", "diagnosis.apply_if_unknown"),
        "effects that are more likely missing than not always enter augmented.yaml now",
    )
    | dict.fromkeys(
        _CREDENCE,
        "how likely an effect is although something speaks against it was fitted to robots with a known truth",
    )
    | dict.fromkeys(_COMMON, "a search begins with what hardly a robot is without where the first ones leave a doubt")
    | dict.fromkeys(
        _LEAST_SCORES,
        "least scores are simulated for the recordings, by the probability of a false alarm "
        "(diagnosis.thresholds.false_alarm_probability)",
    )
)
"""What happens now without a setting that has gone."""

_ROUGH = "give the tolerance itself, diagnosis.tolerances.data_sheet=0.15"
_SEVERAL = "the default finds several effects, too; leave it out"
CHOICES_INSTEAD = {
    "diagnosis": {"rough": _ROUGH, "loose_tolerance": _ROUGH, "several": _SEVERAL, "multi_effect": _SEVERAL}
}
"""What to do now without a choice that has gone, by its group."""

ALIKE = {"update": "updates"}
"""Settings of today that differ from an earlier name by a slip of the finger."""


def renamed(key: str, now: str) -> str:
    """What to say of a setting that is called `now`, as the end of a sentence."""
    if key in INSTEAD:
        return f"has no setting {key!r} any more: {INSTEAD[key]}."
    unit = ", in seconds instead of control periods" if now in IN_SECONDS else ""
    alike = f" Or did you mean {ALIKE[key]!r}?" if key in ALIKE else ""
    return f"has no setting {key!r} any more: it is called {now!r} now{unit}.{alike}"


def name_now(key: str) -> str | None:
    """The name of a setting that had another one, by its dotted key; None where it had not."""
    first, _, rest = key.partition(".")
    if first in _SECTIONS and rest and key not in SETTINGS:
        now = f"{SETTINGS.get(first, first)}.{name_now(rest) or rest}"
        return now if now != key else None
    known = next((part for part in reversed([*ancestors(key), key]) if part in SETTINGS), None)
    return None if known is None else SETTINGS[known] + key.removeprefix(known)
