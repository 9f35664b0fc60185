import hashlib
import json
from dataclasses import replace

import pytest

from twbal.cli.manifest import MANIFEST, StageWork, _source_hash, perform, read_manifest
from twbal.core.errors import ConfigError, DataError


class Work:
    """Writes the sum of its inputs' lengths, and counts how often it did."""

    def __init__(self, step):
        self.step = step
        self.times = 0

    def __call__(self):
        self.times += 1
        made = self.step.out / "sub" / "result.txt"
        made.parent.mkdir(exist_ok=True)
        made.write_text(str(sum(len(path.read_text()) for path in self.step.inputs["data"])))
        return [made]


@pytest.fixture
def step(tmp_path):
    data = tmp_path / "data.txt"
    data.write_text("abc")
    return StageWork("count", tmp_path / "out", "factor: 1\n", {"data": [data]}, seed=7)


def test_the_manifest_tells_what_made_what(step, tmp_path):
    manifest = perform(step, Work(step))
    assert read_manifest(step.out) == manifest
    assert manifest.complete
    assert (manifest.stage, manifest.seed, manifest.settings) == ("count", 7, "factor: 1\n")
    (given,) = manifest.inputs["data"]
    assert (given.path, given.sha256) == (str(tmp_path / "data.txt"), hashlib.sha256(b"abc").hexdigest())
    (made,) = manifest.outputs
    assert (made.path, made.sha256) == ("sub/result.txt", hashlib.sha256(b"3").hexdigest())
    assert {"python", "twbal", "numpy", "torch"} <= set(manifest.versions)
    assert manifest.wall_s >= 0


def test_finished_work_is_not_done_again(step):
    work = Work(step)
    assert perform(step, work) == perform(step, work)
    assert work.times == 1


def test_the_same_input_elsewhere_is_the_same_work(step, tmp_path):
    work = Work(step)
    perform(step, work)
    moved = tmp_path / "data.txt"
    moved = moved.rename(tmp_path / "moved.txt")
    perform(replace(step, inputs={"data": [moved]}), work)
    assert work.times == 1


def test_work_that_was_cut_off_is_done_again_in_place(step):
    def killed():
        step.out.joinpath("half.txt").write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        perform(step, killed)
    before = read_manifest(step.out)
    assert before is not None
    assert not before.complete
    assert perform(step, Work(step)).complete
    assert (step.out / "half.txt").exists()  # what lies there is of the same work


@pytest.mark.parametrize("harm", ["changed", "deleted"])
def test_results_that_are_not_whole_are_made_anew(step, harm):
    work = Work(step)
    manifest = perform(step, work)
    made = step.out / manifest.outputs[0].path
    made.write_text("spoilt") if harm == "changed" else made.unlink()
    again = perform(step, work)
    assert work.times == 2
    assert again.outputs == manifest.outputs


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"settings": "factor: 2\n"}, "other settings (now new: factor=2)"),
        ({"settings": "a:\n  limit: 0.8\nb:\n  limit: 0.8\n"}, "(now new: a.limit=0.8, b.limit=0.8)"),
        ({"seed": 8}, "seed 7"),
        ({"stage": "sum"}, "stage count"),
        ({"inputs": {"data": []}}, "other inputs"),
    ],
)
def test_other_work_is_never_overwritten(step, changes, message):
    perform(step, Work(step))
    other = replace(step, **changes)
    with pytest.raises(ConfigError) as caught:
        perform(other, Work(other))
    assert message in str(caught.value)
    assert "hydra.run.dir" in str(caught.value)
    assert (step.out / "sub" / "result.txt").read_text() == "3"


def test_files_of_no_manifest_are_not_written_over(step):
    kept = step.out / "sub" / "result.txt"
    kept.parent.mkdir(parents=True)
    kept.write_text("a person's own")
    work = Work(step)
    with pytest.raises(ConfigError, match=r"has no manifest.json, but files .*: sub/result.txt. Choose a new folder"):
        perform(step, work)
    assert (work.times, kept.read_text()) == (0, "a person's own")


def test_what_hydra_and_a_failed_job_leave_is_no_ones_work(step):
    for name in (".hydra/config.yaml", ".lock", "failure.log", "count.log"):
        (step.out / name).parent.mkdir(parents=True, exist_ok=True)
        (step.out / name).write_text("")
    assert perform(step, Work(step)).complete


def test_a_folder_in_which_other_work_failed_at_once_is_free(step):
    def fail():
        (step.out / ".hydra").mkdir()
        (step.out / ".hydra" / "config.yaml").touch()
        (step.out / "count.log").touch()
        raise DataError("no such thing")

    with pytest.raises(DataError, match="no such thing"):
        perform(replace(step, seed=8), fail)
    assert perform(step, Work(step)).seed == 7


def test_a_folder_in_which_other_work_left_a_part_is_not(step):
    def fail():
        step.out.joinpath("half.txt").write_text("half")
        raise DataError("the rest is missing")

    with pytest.raises(DataError, match="the rest is missing"):
        perform(replace(step, seed=8), fail)
    with pytest.raises(ConfigError, match="holds the work of seed 8"):
        perform(step, Work(step))


def test_an_input_that_changed_is_another_input(step):
    perform(step, Work(step))
    step.inputs["data"][0].write_text("abcd")
    with pytest.raises(ConfigError, match="other inputs"):
        perform(step, Work(step))


def test_a_missing_input_is_found_before_the_work(step):
    step.inputs["data"][0].unlink()
    work = Work(step)
    with pytest.raises(DataError, match=r"data\.txt"):
        perform(step, work)
    assert work.times == 0
    assert not (step.out / MANIFEST).exists()


MADE = {
    **{"stage": "count", "complete": True, "fingerprint": "a1", "seed": 0, "settings": ""},
    **{"inputs": {}, "outputs": [], "versions": {}, "started": "", "wall_s": 0.0},
}
ODD = [
    *({"settings": 3}, {"versions": {"twbal": 3}}, {"versions": []}, {"wall_s": "3"}, {"seed": "0"}, {"complete": 1}),
    *({"outputs": [{"path": 3, "sha256": ""}]}, {"inputs": {"data": [{"path": "", "sha256": None}]}}, {"wall_s": True}),
]


@pytest.mark.parametrize(
    "text",
    [*("", "{", "[]", "{}", "[" * 10**5, json.dumps({"inputs": {}, "outputs": []}))]
    + [json.dumps({**MADE, **odd}) for odd in ODD],
)
def test_a_foreign_manifest_is_refused(step, text):
    step.out.mkdir()
    (step.out / MANIFEST).write_text(text)
    with pytest.raises(DataError, match="no manifest of this version"):
        perform(step, Work(step))


def test_work_of_other_source_code_is_not_taken_for_done(step, monkeypatch):
    perform(step, Work(step))
    monkeypatch.setattr("twbal.cli.manifest._source_hash", lambda: "of other code")
    with pytest.raises(ConfigError, match="source code"):
        perform(step, Work(step))


def test_the_source_hash_is_that_of_every_module(monkeypatch, tmp_path):
    (tmp_path / "cli").mkdir()
    (tmp_path / "cli" / "manifest.py").write_text("")
    (tmp_path / "effect.py").write_text("width = 1")
    monkeypatch.setattr("twbal.cli.manifest.__file__", str(tmp_path / "cli" / "manifest.py"))
    before = _source_hash.__wrapped__()
    (tmp_path / "effect.py").write_text("width = 2")
    assert _source_hash.__wrapped__() != before
