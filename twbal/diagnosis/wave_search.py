"""The wave that explains most of what a model leaves: poles of motors, waves of a floor, a disturbance that swings.

Its answer in the prediction errors is that of the linear model, so that hundreds of frequencies or counts are tried.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import GRAVITY
from twbal.diagnosis.candidates import Candidate, CandidateParameter
from twbal.planar.constants import Constants, constants
from twbal.sysid.kalman import Filter, LinearPlanarModel
from twbal.sysid.kalman_predictor import PredictorOutput
from twbal.sysid.likelihood import weights_of, whitened
from twbal.sysid.linear_response import match_each
from twbal.sysid.model import Data
from twbal.sysid.prediction_error_fit import Fit

_TOGETHER = 16  # waves whose answers are computed together
_FRACTIONS = 5  # of a control period, over which a torque that depends on the wheels' angle is averaged
_TONES = 8192  # frequencies of the Fourier transform, at least
_COUNT_STEP, _WAVES_STEP = 0.25, 0.1  # at most
_PER_RANGE = 0.5  # of a wave; by which neighbours differ over the whole range of the wheels' angle, or of the way
_OUT_OF_STEP = 0.3  # rad; by which turning must bring the waves of both wheels out of step to show that they are two
_SEEN_APART = 1.0  # rad; by which it must bring them out of step to tell how far the wheels come apart
_TURNING, _TURNINGS = 0.15, 15  # greatest share by which that is looked for to be off, and steps to there at most
_NEAR_COUNT = 0.1  # share of the best count within which others are tried with that


def likeliest_wave(data: Data, fit: Fit, candidate: Candidate) -> dict[str, float]:
    """Frequency (or count, or waves a metre), size and phase of the sine that explains most; of a wave only.

    And by which both wheels' phases differ, of a wave that has a parameter for it.
    """
    if not candidate.is_wave:
        return {}
    parameters = {p.name: p for p in candidate.parameters}
    planar, counter = fit.model.planar, candidate.counter
    if counter is not None and counter.name == "frequency":
        tone = _over_time(data, fit, data.linear(fit.model), counter.low, counter.high)
        scale = 1.0 / planar.wheel_radius
    else:
        tone = _along_the_way(data, fit, counter)
        of_weight = -1.0 / ((planar.body_mass + 2.0 * planar.wheel_mass) * GRAVITY * planar.wheel_radius)
        scale = 0.5 if counter is not None and counter.name == "count" else of_weight
    size = candidate.parameters[0]
    amplitude = float(np.clip(abs(tone.wave) * abs(scale), size.low + 1e-3 * (size.high - size.low), size.high))
    fields = {size.name: amplitude, "phase": float(np.angle(tone.wave * np.sign(scale)))}
    if counter is not None:
        fields[counter.name] = tone.value
    fields |= {name: value for name, value in tone.of_wheels.items() if name in parameters}
    return {candidate.field(parameters[name]): number for name, number in fields.items()}


class _Tone(NamedTuple):
    """A wave that explains errors.

    Attributes:
        value: its frequency, count or waves a metre.
        wave: complex size of the torque Im(wave exp(i value angle)), in the mean of both wheels.
        gain: in -2 log likelihood, with nothing else fitted.
        difference: by which the right wheel's phase is ahead of the left one's [rad].
        turning: share by which the wheels are further ahead of each other, when the robot turns, than was thought.
    """

    value: float
    wave: complex
    gain: float = 0.0
    difference: float = 0.0
    turning: float = 0.0

    @property
    def of_wheels(self) -> dict[str, float]:
        """What it has beyond a wave in the mean of both wheels, by the name of the parameter."""
        return {"difference": self.difference, "turning": self.turning}


def _over_time(data: Data, fit: Fit, linear: LinearPlanarModel, low: float, high: float) -> _Tone:
    """Frequency [Hz] and complex size of the outside torque Im(wave exp(2πi f t)) that explains most."""
    white = fit.white.reshape(-1, 4)
    longest = max(len(recording) for recording in data.recordings)
    tones = max(_TONES, 1 << (2 * longest - 1).bit_length())  # two for each that the longest recording tells apart
    sums, begin, count = np.zeros((tones // 2 + 1, 4), complex), 0, len(white)
    for recording in data.recordings:
        sums += np.fft.rfft(white[begin : begin + len(recording)], tones, axis=0)
        begin += len(recording)
    frequencies = np.fft.rfftfreq(tones, data.period)
    inside = np.flatnonzero((frequencies >= low) & (frequencies <= high))
    K, W = fit.kalman.gains[-1], fit.kalman.whiteners[-1]
    closed = linear.F @ (np.eye(len(linear.F)) - K @ linear.C)
    turns = np.exp(2j * np.pi * frequencies[inside] * data.period)
    # error n follows torque n - 1, which is a mean over its period: its phase is that of the period's middle
    states = len(linear.F)
    inner = np.linalg.solve(
        turns[:, None, None] * np.eye(states) - closed, np.broadcast_to(linear.B[:, 1:], (len(turns), states, 1))
    )
    response = (W @ linear.C @ inner[:, :, 0].T).T * (turns * np.sqrt(turns))[:, None]
    power = (np.abs(response) ** 2).sum(axis=1)
    match = (response.conj() * sums[inside]).sum(axis=1)
    best = int(np.argmax(np.abs(match) ** 2 / power))
    wave = 2.0 * match[best] / (count * power[best])  # torque Re(wave exp(2πi f t))
    return _Tone(float(frequencies[inside[best]]), complex(1j * wave))


def _along_the_way(data: Data, fit: Fit, counter: CandidateParameter | None) -> _Tone:
    """The wave over the wheels' angle, or the way that they roll, that explains most.

    Args:
        data: recordings.
        fit: the model so far.
        counter: of waves in a turn of the joints, or on a metre of the floor; None for one in a turn of the wheels.
    """
    predictions = data.predictions(fit.model, fit.kalman)
    errors = _errors(data, fit, predictions)
    states, ahead = [prediction.states for prediction in predictions], _ahead(data, fit)
    if counter is None:
        return _over_angle(errors, _Waves(1, [each[:, 1] for each in states], ahead), np.ones(1))
    if counter.name == "count":
        return _of_both_wheels(errors, _Waves(0, [each[:, 1] - each[:, 0] for each in states], ahead), counter)
    ways = [2.0 * np.pi * each[:, 8] for each in states]
    grid = _grid(counter, _WAVES_STEP, ways)
    return _over_angle(errors, _Waves(1, ways, [0.0 * way for way in ways]), grid)


def _grid(counter: CandidateParameter, step: float, angles: Sequence[Array]) -> Array:
    """Counts of waves that are tried, so close that none is missed over the widest range of angles (T + 1,) [rad]."""
    widest = max(float(np.ptp(each)) for each in angles) / (2.0 * np.pi)
    return np.arange(counter.low, counter.high + 1e-9, min(step, _PER_RANGE / max(widest, 1e-9)))


class _Errors(NamedTuple):
    """What a model leaves, and how a torque would show in it.

    Attributes:
        linear: the linear model of the model.
        kalman: filter that made the errors.
        weights: (T + 1,) of each recording, of instants (`weights_of`).
        white: (T, 4) of each recording, whitened and weighted, without the first instant.
    """

    linear: LinearPlanarModel
    kalman: Filter
    weights: Sequence[Array]
    white: Sequence[Array]


def _errors(data: Data, fit: Fit, predictions: Sequence[PredictorOutput]) -> _Errors:
    """Of what a fit predicts."""
    errors = [prediction.errors for prediction in predictions]
    weights = weights_of(errors, data.usable, fit.kalman)
    white = [whitened(fit.kalman, [own], [each]).reshape(-1, 4) for own, each in zip(weights, errors, strict=True)]
    return _Errors(data.linear(fit.model), fit.kalman, weights, white)


def _ahead(data: Data, fit: Fit) -> list[Array]:
    """By which one wheel is ahead of the mean and the other behind it, (T + 1,) of each recording [rad]."""
    k: Constants = constants(fit.model.planar, data.period / data.substeps)
    return [k.apart * recording.heading for recording in data.recordings]


class _Waves(NamedTuple):
    """Where a torque in waves may act.

    Attributes:
        which: 0 for a torque at the joints, 1 for one on the wheels from outside.
        angles: (T + 1,) of each recording, the mean of both wheels [rad].
        ahead: (T + 1,) of each recording, by which one wheel is ahead of the mean and the other behind [rad].
        are_two: whether the phases of both wheels may differ.
    """

    which: int
    angles: Sequence[Array]
    ahead: Sequence[Array]
    are_two: bool = False

    @property
    def columns(self) -> int:
        """Of each count: sine and cosine where the wheels are in step, and where they are a quarter of a wave apart."""
        return 4 if self.are_two else 2


def _of_both_wheels(errors: _Errors, waves: _Waves, counter: CandidateParameter) -> _Tone:
    """The wave that explains most in the joints of both wheels, each with a phase of its own where turning shows it.

    How far the wheels come apart when the robot turns is known as well as its track and its wheels, which may not do:
    with twenty poles and three turns, one part in a hundred makes most of a wave. So other values are tried, too, at
    counts near the best one.
    """
    counts = _grid(counter, _COUNT_STEP, waves.angles)
    apart = max(float(np.ptp(each)) for each in waves.ahead)
    if apart * counter.high < _OUT_OF_STEP:
        return _over_angle(errors, waves, counts)
    waves = waves._replace(are_two=True)
    best = _over_angle(errors, waves, counts)
    step = 2.0 * _SEEN_APART / max(apart * best.value, 1e-9)
    near = counts[np.abs(counts - best.value) <= _NEAR_COUNT * best.value]
    for turning in step * np.arange(1.0, min(_TURNING / step, _TURNINGS) + 1e-9):
        for signed in (turning, -turning):
            tried = waves._replace(ahead=[(1.0 + signed) * each for each in waves.ahead])
            tone = _over_angle(errors, tried, near)._replace(turning=signed)
            best = max(best, tone, key=lambda each: each.gain)
    return best


def _over_angle(errors: _Errors, waves: _Waves, counts: Array) -> _Tone:
    """The wave that explains most.

    Args:
        errors: that the model so far leaves.
        waves: where it acts.
        counts: that are tried, evenly spaced.
    """
    linear, kalman = errors.linear, errors.kalman
    push = linear.B[:, waves.which].copy()
    between = [_within_periods(angles) for angles in waves.angles]
    sizes: Array = np.zeros(waves.columns)
    best, value = -np.inf, float(counts[0])
    for begin in range(0, len(counts), _TOGETHER):
        tried = counts[begin : begin + _TOGETHER]
        pull: Array = np.zeros((waves.columns, len(tried)))
        squares: Array = np.zeros((waves.columns, waves.columns, len(tried)))
        for angles, ahead, weights, white in zip(between, waves.ahead, errors.weights, errors.white, strict=True):
            torques = _over_periods(tried, angles, ahead, waves.columns)
            own = match_each(linear.F, linear.C, kalman.gains, push, torques, kalman.whiteners, weights, white)
            pull, squares = pull + own[0], squares + own[1]
        for i, count in enumerate(tried):
            if not (np.isfinite(pull[:, i]).all() and np.isfinite(squares[:, :, i]).all()):
                continue  # errors that grow without end, by a filter that does not hold them, tell nothing of a wave
            found = np.asarray(np.linalg.lstsq(squares[:, :, i], pull[:, i], rcond=None)[0], np.float64)
            gain = float(pull[:, i] @ found)
            if gain > best:
                best, value, sizes = gain, float(count), found
    if not waves.are_two:
        return _Tone(value, complex(sizes[0], sizes[1]), best)
    # both wheels together: cos(count ahead + ½ difference) Im(wave exp(i count angle)), of rank one
    out, singular, along = np.linalg.svd(sizes.reshape(2, 2))
    sign = 1.0 if out[0, 0] >= 0.0 else -1.0
    difference = -2.0 * float(np.arctan2(sign * out[1, 0], sign * out[0, 0]))
    return _Tone(value, complex(*(sign * singular[0] * along[0])), best, difference)


def _within_periods(angles: Array) -> Array:
    """Angles (T + 1,) at instants within each control period, (fractions, T)."""
    shares = (np.arange(_FRACTIONS) + 0.5) / _FRACTIONS
    return np.asarray(angles[:-1] + shares[:, None] * np.diff(angles))


def _over_periods(counts: Array, angles: Array, ahead: Array, columns: int) -> Array:
    """Means of sine and cosine of waves over each control period and both wheels, (T, columns, counts).

    Args:
        counts: evenly spaced.
        angles: (fractions, T).
        ahead: (T + 1,).
        columns: of each count, as of `_Waves`.
    """
    found = np.empty((angles.shape[1], columns, len(counts)))
    step = counts[1] - counts[0] if len(counts) > 1 else 0.0
    turned, apart = np.exp(1j * counts[0] * angles), np.exp(1j * counts[0] * ahead[:-1])
    by, further = np.exp(1j * step * angles), np.exp(1j * step * ahead[:-1])
    for number in range(len(counts)):
        mean = turned.mean(axis=0)
        for i, in_step in enumerate((apart.real, apart.imag)[: columns // 2]):
            found[:, 2 * i, number], found[:, 2 * i + 1, number] = in_step * mean.imag, in_step * mean.real
        turned, apart = turned * by, apart * further  # as sines and cosines of each count take ten times as long
    return found
