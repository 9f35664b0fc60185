import os
import subprocess
import sys

import numpy as np
import pytest

from twbal.core.compiled import cache_folder, method_kernel, type_of
from twbal.core.errors import ConfigError


def folder_seen(**environment):
    """The cache folder of a fresh process."""
    words = [sys.executable, "-c", "from twbal.core.compiled import numba; print(numba.config.CACHE_DIR)"]
    found = subprocess.run(words, env={**os.environ, **environment}, capture_output=True, text=True, check=True)
    return found.stdout.strip()


def test_machine_code_lies_in_the_persons_cache(tmp_path):
    assert folder_seen(XDG_CACHE_HOME=str(tmp_path)).startswith(f"{tmp_path}/twbal/kernels-")


def test_a_cache_that_the_person_chose_is_used(tmp_path):
    assert folder_seen(NUMBA_CACHE_DIR=str(tmp_path)) == str(tmp_path)


def test_a_home_that_cannot_be_written_to_is_no_obstacle(tmp_path):
    (tmp_path / "file").write_text("")
    assert "kernels-" in folder_seen(XDG_CACHE_HOME=str(tmp_path / "file"))


@pytest.fixture
def nowhere_but_temporary(tmp_path, monkeypatch):
    """A person whose home cannot be written to, and the folder that stands in for the system's temporary one."""
    (tmp_path / "file").write_text("")
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    return temporary


def test_a_temporary_cache_is_for_its_owner_alone(nowhere_but_temporary):
    folder = cache_folder()
    assert folder.parent == nowhere_but_temporary / f"twbal-{os.getuid()}"
    assert folder.parent.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("trap", ["open to all", "a link", "a file"])
def test_a_temporary_cache_that_others_could_have_filled_is_not_used(nowhere_but_temporary, trap, tmp_path):
    place = nowhere_but_temporary / f"twbal-{os.getuid()}"
    if trap == "open to all":
        place.mkdir()
        place.chmod(0o777)
    elif trap == "a link":
        (tmp_path / "elsewhere").mkdir()
        place.symlink_to(tmp_path / "elsewhere")
    else:
        place.write_text("")
    folder = cache_folder()
    assert folder.parent != place
    assert folder.parent.stat().st_mode & 0o077 == 0


def test_another_source_is_another_folder(tmp_path, monkeypatch):
    source = tmp_path / "some.py"
    names = []
    for text in ("x = 1", "x = 2"):
        source.write_text(f"from twbal.core.compiled import kernel\n{text}\n")
        monkeypatch.setattr("twbal.core.compiled._PACKAGE", tmp_path)
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
        names.append(cache_folder().name)
    assert names[0] != names[1]


DIGITS = """
import hashlib
import numpy as np
from twbal.models.moments.kernel_sum import KernelSum
from twbal.models.moments.moment_prediction import predict_by_series
from twbal.models.moments.truncation import Truncation, series
rng = np.random.default_rng(0)
parts = [rng.standard_normal((9, 2)), np.ones((1, 2)), np.ones(1), rng.standard_normal((1, 9))]
sums = [KernelSum(*parts, np.zeros((1, 0, 0))), KernelSum(*parts, rng.standard_normal((1, 9, 9)))]
for truncation in (Truncation(), Truncation(degrees=())):
    found = predict_by_series(*sums, np.zeros(2), 0.1 * np.eye(2), series(truncation, 2), 2, np.zeros(1))
    for values in (found.mean, found.slope, found.rest, found.exact_by_mean, found.exact_by_covariance):
        print(hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_code_just_compiled_and_code_from_the_cache_give_the_same_digits(tmp_path):
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    words = [sys.executable, "-c", DIGITS]
    runs = [subprocess.run(words, env=environment, capture_output=True, text=True, check=True).stdout for _ in range(2)]
    assert runs[0] == runs[1]


class Wrong:
    """Methods that cannot be parts of kernels."""

    def unknown_name(self, force):
        return absent(force)  # noqa: F821

    def unknown_function(self, force):
        return np.absent(force)

    def no_number(self, force):
        return "a" + force

    def unsupported(self, force):
        with open("file") as file:
            return float(file.read()) + force

    def returns_nothing(self, force):
        force += 1.0

    def returns_a_pair(self, force):
        return force, force


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("unknown_name", "name 'absent' is not defined"),
        ("unknown_function", "'numpy' has no attribute 'absent'"),
        ("no_number", r"add\(Literal\[str\]\(a\), float64\)"),
        ("unsupported", "construct is not supported"),
        ("returns_nothing", "it returns none, expected float"),
        ("returns_a_pair", r"it returns UniTuple\(float64 x 2\), expected float"),
    ],
)
def test_a_method_that_numba_cannot_compile_is_told_in_one_line_that_names_it(name, said):
    with pytest.raises(ConfigError, match=said) as refused:
        method_kernel(Wrong, name, (type_of(1.0), type_of(1.0)), float)
    message = str(refused.value)
    assert message.startswith(
        f"Method '{name}' of Wrong ({__file__}, line {getattr(Wrong, name).__code__.co_firstlineno})"
    )
    assert "\n" not in message
    assert len(message) < 500


def test_a_method_that_returns_a_whole_number_is_a_part_of_kernels():
    class Right:
        def method(self, force):
            return 1

    assert method_kernel(Right, "method", (type_of(1.0), type_of(1.0)), float)(1.0, 2.0) == 1
