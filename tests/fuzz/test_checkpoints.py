"""Whatever lies in a .pt file: a valid object comes out of it, or one of twbal's errors."""

import io
import tempfile
from pathlib import Path

import numpy as np
import torch
from fuzzing import changed, fuzzed, mutated, ours_only, plain
from hypothesis import strategies as st

from twbal.algorithm.model_file import SavedModel, load_model, save_model
from twbal.algorithm.prediction import Assessment, PredictedBy, Prediction, load_prediction, save_prediction
from twbal.core.channels import Channels
from twbal.core.gaussian import Gaussian
from twbal.io.checkpoint import save_checkpoint
from twbal.models.dynamics import DynamicsModel
from twbal.models.gp import GaussianProcess
from twbal.policies.linear import LinearPolicy
from twbal.policies.mlp import MlpPolicy
from twbal.policies.rbf import RbfPolicy
from twbal.policies.saved import load_policy
from twbal.search.predictor import Predictor

NAMES = ("tilt", "tilt_rate")
POLICIES = [
    LinearPolicy(NAMES, np.array([3.0, 0.5]), 0.2, 4.0).to_payload(),
    RbfPolicy(NAMES, np.zeros((2, 2)), np.ones(2), np.ones(2), np.array([1.0, 0.1]), 4.0).to_payload(),
    MlpPolicy(NAMES, (np.ones((3, 2)), np.ones((1, 3))), (np.zeros(3), np.zeros(1)), "tanh", "clip", 4.0).to_payload(),
]
GP = GaussianProcess(
    np.eye(4, 3), np.ones((2, 3)), np.ones(2), np.ones(2), np.ones((2, 4)), np.tile(np.eye(4), (2, 1, 1))
)
MODEL = DynamicsModel(Channels(NAMES, 0.1), GP, GP, True, np.zeros(2), np.zeros(2))
VERDICT = Assessment("search 0", 3.0, 1.0, 0.1, None)
BY = (PredictedBy(Predictor.ROBOTS, 1.0, 0.1, "mean parameters"), PredictedBy(Predictor.MODEL, 2.0))
PREDICTION = Prediction(NAMES, (Gaussian(np.zeros(2), np.eye(2)),) * 3, VERDICT, (VERDICT,), BY)


def written(save, *arguments):
    """The bytes that `save` writes."""
    with tempfile.TemporaryDirectory() as folder:
        save(Path(folder) / "file", *arguments)
        return (Path(folder) / "file").read_bytes()


def read_all(path):
    """Read a checkpoint as each of its kinds; what is accepted must work."""
    policy = ours_only(load_policy, path, NAMES)
    if policy is not None:
        with np.errstate(over="ignore"):
            commands = policy.command(np.array([[0.1, -0.2], [1e30, -1e30], [0.0, 0.0]]))
        assert np.abs(commands).max() <= policy.max_command
    saved = ours_only(load_model, path)
    if saved is not None:
        with np.errstate(all="ignore"):
            assert saved.model.step_mean(np.zeros((2, len(saved.model.channels.names))), np.zeros(2)).shape[0] == 2
    prediction = ours_only(load_prediction, path)
    if prediction is not None:
        assert all(np.isfinite(state.mean).all() for state in prediction.states)


FILES = [written(save_checkpoint, "policy", payload) for payload in POLICIES]
FILES += [written(save_model, SavedModel(MODEL, {"robot": ["a1"]})), written(save_prediction, PREDICTION)]

arrays = st.builds(
    lambda shape, value, kind: np.full(shape, value).astype(kind),
    st.lists(st.integers(0, 4), max_size=3),
    st.sampled_from([0.0, 1.0, -1.0, 1e30, np.nan, np.inf]),
    st.sampled_from(["f8", "f4"]),
)
values = st.one_of(plain, arrays, st.lists(arrays, max_size=3))


@fuzzed(data=st.one_of(st.binary(max_size=300), st.binary(max_size=300).map(lambda more: b"PK\x03\x04" + more)))
def test_random_bytes(path, data):
    path.write_bytes(data)
    read_all(path)


@fuzzed(data=st.sampled_from(FILES).flatmap(mutated))
def test_whole_files_with_bytes_changed(path, data):
    path.write_bytes(data)
    read_all(path)


def pickled(kind, payload):
    """A checkpoint of anything, whether or not twbal would write it."""
    stream = io.BytesIO()
    tensors = _with_tensors(payload)
    torch.save({"format": "twbal checkpoint", "schema_version": 1, "kind": kind, "payload": tensors}, stream)
    return stream.getvalue()


def _with_tensors(value):
    if isinstance(value, np.ndarray):
        return torch.from_numpy(value)
    if isinstance(value, dict):
        return {key: _with_tensors(item) for key, item in value.items()}
    return [_with_tensors(item) for item in value] if isinstance(value, list | tuple) else value


WHOLE = [("policy", payload) for payload in POLICIES]
WHOLE += [("model", {**MODEL.to_payload(), "episodes": {"robot": ["a1"]}})]
WHOLE += [
    (
        "prediction",
        {
            "channels": list(NAMES),
            "mean": np.zeros((3, 2)),
            "covariance": np.zeros((3, 2, 2)),
            "best": vars(VERDICT),
            "candidates": [vars(VERDICT)],
        },
    )
]


@fuzzed(case=st.sampled_from(WHOLE).flatmap(lambda whole: st.tuples(st.just(whole[0]), changed(whole[1], values))))
def test_payloads_with_a_part_changed(path, case):
    path.write_bytes(pickled(*case))
    read_all(path)


@fuzzed(content=plain)
def test_torch_files_of_anything(path, content):
    torch.save(content, path)
    read_all(path)


def test_the_files_that_are_changed_are_whole(tmp_path):
    for number, data in enumerate(FILES):
        (tmp_path / "file").write_bytes(data)
        readers = [load_policy, load_policy, load_policy, load_model, load_prediction]
        assert readers[number](tmp_path / "file", *([NAMES] if number < 3 else [])) is not None
