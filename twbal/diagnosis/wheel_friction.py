"""What holds wheels in the air back, from how far they turn under the recorded commands.

From the start of each window the planar model runs alone, and turns too far or not far enough. What makes up for that
is drag, in one of a few forms, or motors that are stronger or weaker than the data sheet says, within its tolerance.
Long windows forgive commands that were logged as samples of a faster loop, which one step at a time would drown in.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.special import fdtri, ndtri, stdtrit

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.calibration import Objected, calibration
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.data_sheet import DATA_SHEET
from twbal.diagnosis.filter_result import filter_result_of, one_step_errors
from twbal.diagnosis.findings import Effects, FilterResult, Findings
from twbal.diagnosis.name import autocorrelation_of, first_noise, sensed_values
from twbal.diagnosis.record import LISTED, Estimate, ProbableEffect, Rival, Shift, Verdict
from twbal.diagnosis.settings import Settings
from twbal.diagnosis.wheel_turns import WINDOW, Turns, windows_of
from twbal.planar.parameters import PlanarParameters, planar_parameters
from twbal.sysid.intervals import interval
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import LASTING
from twbal.sysid.recording import Recording

FORMS = ("coulomb_friction", "viscous_friction", "dead_zone")
"""Effects that hold wheels back, in the order in which they are believed where the data cannot tell."""

SEPARATE_BY = "Turn the wheels at several speeds, both ways."

_GAIN = "torque_gain_gain"
_LEFT = 0.5  # share of what windows are off by that a finding may leave
_ROUNDS, _NOISE_ROUNDS = 6, 30


class _FrictionFit(NamedTuple):
    """Drag of one form, fitted together with the motors' strength.

    Attributes:
        candidate: which; None for the motors' strength alone.
        value: of its parameter.
        error: standard error of `value`.
        gain: of the motors.
        strength: `gain` over that which the simulation has.
        misfit: -2 log likelihood, with the prior of the gain and the price of the parameter.
        rms: by which windows are still off [rad].
        at_bound: whether `value` ran to a bound.
    """

    candidate: Candidate | None
    value: float
    error: float
    gain: float
    strength: float
    misfit: float
    rms: float
    at_bound: bool

    @property
    def names(self) -> tuple[str, ...]:
        """What it names."""
        return (self.candidate.name,) if self.candidate else ()

    @property
    def effects(self) -> dict[str, dict[str, float]]:
        """What the simulation would have to add."""
        found = {"torque_gain": {"gain": self.gain}}
        if self.candidate:
            found[self.candidate.name] = {self.candidate.parameters[0].name: self.value}
        return found


def identify_friction(
    recordings: Sequence[Recording],
    robot: RobotParameters,
    effects: Effects,
    candidates: Sequence[Candidate],
    settings: Settings,
    progress: Callable[[str], None] = lambda line: None,
) -> Findings:
    """Name what holds the wheels of a robot back that turn in the air.

    Args:
        recordings: of some windows at least.
        robot: data sheet of the robot, held (`in_air.held`).
        effects: that the simulation has already.
        candidates: all that may be missing; those of `FORMS` are hypothesis.
        settings: of the diagnosis.
        progress: is told what is being done, a line at a time.

    Raises:
        DataError: no recording is as long as two windows.
    """
    data = Data(recordings, settings.substeps)
    turns = Turns(data, *windows_of(data))
    planar = planar_parameters(robot, effects)
    forms_tried = [c for name in FORMS for c in candidates if c.name == name and name not in settings.exclude]
    settings = replace(settings, tolerances=settings.tolerances.for_robot(robot))
    tolerance = settings.tolerances.of(_GAIN)
    progress(f"wheels in the air: fitting {len(forms_tried)} forms of drag")
    base, *forms = [_fit(turns, planar, candidate, tolerance) for candidate in (None, *forms_tried)]
    stronger = _fit(turns, planar, None, np.inf)  # motors of any strength
    least = min(form.misfit for form in (base, *forms))
    near = [form for form in forms if form.misfit - least < settings.thresholds.equivalence_margin]
    chosen = near[0] if near else base
    verdict = _verdict(turns, planar, base, chosen, settings)
    best = chosen if verdict is Verdict.NAMED else base
    weights = _probabilities((base, *forms), settings)
    noise = first_noise(robot, data.sensed)._replace(discrepancy=np.zeros(LASTING))
    start = Model(planar, 0.0, noise)

    def seen(added: Effects) -> tuple[Model, FilterResult]:
        taken = {**effects, **added}
        model = data.with_noise(start._replace(planar=planar_parameters(robot, taken)), _NOISE_ROUNDS)
        return model, filter_result_of(data, model, taken)

    (nominal, first), (_, refitted), (named, last) = seen({}), seen(base.effects), seen(best.effects)
    shift = (best.strength - 1.0) / tolerance
    return Findings(
        verdict=verdict,
        effects=_probable(chosen, near, weights, verdict, settings),
        added=best.names,
        data_sheet=(Shift("torque_gain", DATA_SHEET[_GAIN].group, best.strength, shift),),
        data_sheet_class=(DATA_SHEET[_GAIN].group,) if verdict is Verdict.DATA_SHEET else (),
        rivals=tuple(
            Rival(form.names, base.misfit - form.misfit, weights[form.names], 1.0)
            for form in sorted((base, *forms), key=lambda form: form.misfit)
        ),
        autocorrelation=autocorrelation_of(data, nominal, named),
        is_autocorrelated=False,  # wheels in the air are judged by windows
        noise=sensed_values(data, named.noise.sensors),
        advice=_advice(turns, stronger, chosen, near, verdict, settings),
        nominal=first,
        nominal_errors=one_step_errors(data, nominal, named),
        refitted=refitted,
        named=last,
        without={name: refitted for name in best.names},
    )


def _fit(turns: Turns, planar: PlanarParameters, candidate: Candidate | None, tolerance: float) -> _FrictionFit:
    """Fit one form of drag, or none, and the motors' strength within its tolerance.

    Both start from what the simulation has already; drag may double where that is more than robots usually have.
    """
    parameters = candidate.parameters if candidate else ()
    fields = [_GAIN, *(candidate.field(p) for p in parameters if candidate)]
    gain, *already = [float(getattr(planar, field)) for field in fields]
    low = np.array([0.2 * gain, *(p.low for p in parameters)])
    high = np.array([5.0 * gain, *(max(p.high, 2.0 * value) for p, value in zip(parameters, already, strict=True))])
    x = np.array([gain, *(0.1 * p.start + value for p, value in zip(parameters, already, strict=True))])
    sigma = max(float(np.sqrt(np.mean(turns.off_by(planar) ** 2))), turns.floor)
    for _ in range(_ROUNDS):  # the motors' strength gives way only where the windows have become sure

        def misfit(x: Array, sigma: float = sigma) -> Array:
            off = turns.off_by(planar._replace(**dict(zip(fields, x.tolist(), strict=True))))
            return np.append(off / sigma, (x[0] / gain - 1.0) / tolerance)

        result = least_squares(misfit, x, bounds=(low, high), x_scale=high - low)
        x, off = result.x, sigma * result.fun[:-1]
        sigma = float(np.sqrt(np.mean(off**2) + turns.floor**2))
    count = len(off)
    price = len(parameters) * float(np.log(count))
    ends = 1e-3 * (high - low)
    return _FrictionFit(
        candidate,
        value=float(x[-1]) if candidate else 0.0,
        error=_standard_error(result.jac),
        gain=float(x[0]),
        strength=float(x[0] / gain),
        misfit=2.0 * count * float(np.log(sigma)) + float(result.fun[-1] ** 2) + price,
        rms=float(np.sqrt(np.mean(off**2))),
        at_bound=bool(candidate and x[-1] > high[-1] - ends[-1]),
    )


def _standard_error(J: Array) -> float:
    """Standard error of the last of P parameters, for intervals of a normal distribution.

    The spread of the windows is known from these alone. So its share counts by Student's distribution, of as many
    degrees of freedom as windows exceed the parameters that they determine; the share of the motors' strength, whose
    tolerance is known, does not.

    Args:
        J: (n + 1, P) derivatives of n windows, each over the windows' spread, and of the prior.
    """
    covariance = np.linalg.pinv(J.T @ J)
    of_windows = float(np.sum((J[:-1] @ covariance[:, -1]) ** 2))
    count = len(J) - 1
    free = max(count - float(np.sum((J[:-1] @ covariance) * J[:-1])), 1.0)
    scale = count / free * (stdtrit(free, 0.975) / ndtri(0.975)) ** 2
    return float(np.sqrt(covariance[-1, -1] + (scale - 1.0) * of_windows))


def _least_gain(windows: int, settings: Settings) -> float:
    """Gain, less the BIC penalty, from which on the best form of drag is worth it: by Fisher's F distribution.

    As that of effects (`null_distribution`), with the temperature.
    """
    free = windows - 2
    F = float(fdtri(1, free, 1.0 - settings.thresholds.false_alarm_probability / len(FORMS)))
    return settings.temperature * windows * float(np.log1p(F / free)) - float(np.log(windows))


def _verdict(
    turns: Turns, planar: PlanarParameters, base: _FrictionFit, chosen: _FrictionFit, settings: Settings
) -> Verdict:
    """What the fits come to."""
    thresholds = settings.thresholds
    shift = abs(base.strength - 1.0) / settings.tolerances.of(_GAIN)
    if chosen.candidate and base.misfit - chosen.misfit > _least_gain(len(turns.windows), settings):
        before = float(np.sqrt(np.mean(turns.off_by(planar) ** 2)))
        return Verdict.NAMED if chosen.rms < _LEFT * before and not chosen.at_bound else Verdict.UNKNOWN
    if shift > thresholds.max_shift:
        return Verdict.UNKNOWN
    if shift > thresholds.min_reported_shift:
        return Verdict.DATA_SHEET
    return Verdict.NONE


def _probabilities(forms: Sequence[_FrictionFit], settings: Settings) -> Mapping[tuple[str, ...], float]:
    """Of each form, by what it names."""
    odds = np.log(settings.prior / (1.0 - settings.prior)) * np.array([len(form.names) for form in forms])
    scores = odds - np.array([form.misfit for form in forms]) / (2.0 * settings.temperature)
    weights = np.exp(scores - scores.max())
    return dict(zip([form.names for form in forms], (weights / weights.sum()).tolist(), strict=True))


def _probable(
    chosen: _FrictionFit,
    near: Sequence[_FrictionFit],
    weights: Mapping[tuple[str, ...], float],
    verdict: Verdict,
    settings: Settings,
) -> tuple[ProbableEffect, ...]:
    """The chosen form, and those that do as well; none where no drag does as well."""
    if chosen.candidate is None:
        return ()
    (parameter,) = chosen.candidate.parameters
    error = float(np.hypot(chosen.error, settings.thresholds.form_error * chosen.value))
    estimate = Estimate(chosen.value, *interval(chosen.value, error), parameter.unit)
    weight = min(sum(weights[form.names] for form in near), 1.0)
    what = Objected.OTHERS if verdict is Verdict.UNKNOWN else Objected.NOTHING
    effect = ProbableEffect(
        chosen.candidate.name,
        calibration().corrected(weight, what),
        verdict is Verdict.NAMED,
        {parameter.name: estimate},
        tuple(form.candidate.name for form in near if form.candidate and form is not chosen),
        SEPARATE_BY,
        uncalibrated=weight,
        objected=what,
    )
    return (effect,) if effect.probability >= LISTED else ()


def _advice(
    turns: Turns,
    stronger: _FrictionFit,
    chosen: _FrictionFit,
    near: Sequence[_FrictionFit],
    verdict: Verdict,
    settings: Settings,
) -> tuple[str, ...]:
    """What the recordings do not carry; `stronger` has no drag, and motors of whatever strength fits best."""
    low, high = np.quantile([window.rate for window in turns.windows], [0.0, 1.0])
    found = [f"The wheels turn at {low:.3g} to {high:.3g} rad/s in {len(turns.windows)} windows of {WINDOW} s."]
    if verdict is Verdict.NAMED and len(near) > 1:
        values = [
            f"{form.candidate.name.replace('_', ' ')} of {form.value:.3g} {form.candidate.parameters[0].unit}"
            for form in near
            if form.candidate
        ]
        found.append(f"Each of these alone would do: {', '.join(values)}. {SEPARATE_BY}")
    off = abs(stronger.strength - 1.0) / settings.tolerances.of(_GAIN)
    does_as_well = stronger.misfit - chosen.misfit < settings.thresholds.equivalence_margin
    if verdict in (Verdict.NAMED, Verdict.UNKNOWN) and does_as_well and off > 1.0:
        found.append(
            f"So would motors of {stronger.strength:.2g} times the simulation's torque do, {off:.0f} tolerances off: "
            "if the motors may be that far from the data sheet, these recordings do not tell one from the other."
        )
    return tuple(found)
