"""A policy of each kind, where there is a compiler for its header."""

import pytest

from benchmarks.on_boards.kinds_of_policies import COMPILER, POLICIES, compiled, exported, widths_of

__all__ = ["COMPILER", "POLICIES", "compiled", "exported", "needs_compiler", "widths_of"]
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="there is no C compiler to compile the header with")
