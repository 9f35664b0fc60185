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
from twbal.sysid.kalman import Filter, LinearPlanarModel, respond_each
from twbal.sysid.likelihood import whiten
from twbal.sysid.model import Data
from twbal.sysid.prediction_error_fit import Fit
from twbal.sysid.recording import Recording

_TOGETHER = 16  # waves whose answers are computed together
_FRACTIONS = 5  # of a control period, over which a torque that depends on the wheels' angle is averaged
_TONES = 8192  # frequencies of the Fourier transform
_COUNT_STEP, _WAVES_STEP = 0.25, 0.1
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
    linear, planar, counter = data.linear(fit.model), fit.model.planar, candidate.counter
    of_weight = -1.0 / ((planar.body_mass + 2.0 * planar.wheel_mass) * GRAVITY * planar.wheel_radius)
    if counter is None:  # once in a turn of the wheels
        angles = [states[:, 1] for states in _states(data, fit)]
        tone, scale = _over_angle(data, fit, linear, _Waves(1, angles, _ahead(data, fit)), np.ones(1)), of_weight
    elif counter.name == "frequency":
        tone, scale = _over_time(data, fit, linear, counter.low, counter.high), 1.0 / planar.wheel_radius
    elif counter.name == "count":
        angles = [states[:, 1] - states[:, 0] for states in _states(data, fit)]
        tone, scale = _of_both_wheels(data, fit, linear, _Waves(0, angles, _ahead(data, fit)), counter), 0.5
    else:
        ways = [2.0 * np.pi * states[:, 8] for states in _states(data, fit)]
        grid = np.arange(counter.low, counter.high + 1e-9, _WAVES_STEP)
        tone = _over_angle(data, fit, linear, _Waves(1, ways, [0.0 * way for way in ways]), grid)
        scale = of_weight
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
    sums, begin, count = np.zeros((_TONES // 2 + 1, 4), complex), 0, len(white)
    for recording in data.recordings:
        part = white[begin : begin + len(recording)][:_TONES]
        sums += np.fft.rfft(part, _TONES, axis=0)
        begin += len(recording)
    frequencies = np.fft.rfftfreq(_TONES, data.period)
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


def _states(data: Data, fit: Fit) -> list[Array]:
    """The predictor's states of each recording, (T + 1, 15)."""
    return [prediction.states for prediction in data.predictions(fit.model, fit.kalman)]


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


def _of_both_wheels(
    data: Data, fit: Fit, linear: LinearPlanarModel, waves: _Waves, counter: CandidateParameter
) -> _Tone:
    """The wave that explains most in the joints of both wheels, each with a phase of its own where turning shows it.

    How far the wheels come apart when the robot turns is known as well as its track and its wheels, which may not do:
    with twenty poles and three turns, one part in a hundred makes most of a wave. So other values are tried, too, at
    counts near the best one.
    """
    counts = np.arange(counter.low, counter.high + 1e-9, _COUNT_STEP)
    apart = max(float(np.ptp(each)) for each in waves.ahead)
    if apart * counter.high < _OUT_OF_STEP:
        return _over_angle(data, fit, linear, waves, counts)
    waves = waves._replace(are_two=True)
    best = _over_angle(data, fit, linear, waves, counts)
    step = 2.0 * _SEEN_APART / max(apart * best.value, 1e-9)
    near = counts[np.abs(counts - best.value) <= _NEAR_COUNT * best.value]
    for turning in step * np.arange(1.0, min(_TURNING / step, _TURNINGS) + 1e-9):
        for signed in (turning, -turning):
            tried = waves._replace(ahead=[(1.0 + signed) * each for each in waves.ahead])
            tone = _over_angle(data, fit, linear, tried, near)._replace(turning=signed)
            best = max(best, tone, key=lambda each: each.gain)
    return best


def _over_angle(data: Data, fit: Fit, linear: LinearPlanarModel, waves: _Waves, counts: Array) -> _Tone:
    """The wave that explains most.

    Args:
        data: recordings.
        fit: the model so far.
        linear: the linear model.
        waves: where it acts.
        counts: that are tried.
    """
    white = fit.white
    push = linear.B[:, waves.which].copy()
    between = [_within_periods(angles) for angles in waves.angles]
    best, value, wave = -np.inf, float(counts[0]), np.zeros((len(white), waves.columns))
    for begin in range(0, len(counts), _TOGETHER):
        tried = counts[begin : begin + _TOGETHER]
        pieces = [
            _answers(linear, fit.kalman, push, _over_periods(tried, angles, ahead, waves.columns), recording)
            for angles, ahead, recording in zip(between, waves.ahead, data.recordings, strict=True)
        ]
        columns = np.concatenate(pieces, axis=1)  # (columns · tried, N)
        for count, own in zip(tried, columns.reshape(len(tried), waves.columns, -1), strict=True):
            X = np.stack(list(own), axis=1)
            pull = X.T @ white
            squares = X.T @ X
            if not (np.isfinite(pull).all() and np.isfinite(squares).all()):
                continue  # errors that grow without end, by a filter that does not hold them, tell nothing of a wave
            gain = float(pull @ np.linalg.lstsq(squares, pull, rcond=None)[0])
            if gain > best:
                best, value, wave = gain, float(count), X
    sizes, *_ = np.linalg.lstsq(wave, white, rcond=None)
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
    """Means of sine and cosine of waves over each control period and both wheels, (T, columns · counts).

    Args:
        counts: evenly spaced.
        angles: (fractions, T).
        ahead: (T + 1,).
        columns: of each count, as of `_Waves`.
    """
    found = np.empty((angles.shape[1], len(counts), columns))
    turned = np.exp(1j * counts[0] * angles)
    by = np.exp(1j * (counts[1] - counts[0]) * angles) if len(counts) > 1 else turned
    for number, count in enumerate(counts):
        mean = turned.mean(axis=0)
        for i, in_step in enumerate((np.cos, np.sin)[: columns // 2]):
            wave = in_step(count * ahead[:-1]) * mean
            found[:, number, 2 * i], found[:, number, 2 * i + 1] = wave.imag, wave.real
        turned = turned * by  # as sines and cosines of each count take ten times as long
    return found.reshape(len(found), -1)


def _answers(linear: LinearPlanarModel, kalman: Filter, push: Array, torques: Array, recording: Recording) -> Array:
    """Whitened prediction errors that series of torques (T, m) leave, (m, 4 T)."""
    found = respond_each(linear.F, linear.C, kalman.gains, push, torques)
    return np.array([whiten(each, recording.usable, kalman.whiteners, kalman.measured).ravel() for each in found])
