"""How many threads numeric libraries may use: one, unless the person says otherwise.

The matrices here are small: more threads wait for each other (a fit took ten times as long beside another busy
process), and sums in another order on every machine would give other hashes.
"""

import os
from collections.abc import Mapping

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def default_to_one_thread() -> None:
    """One thread where the environment sets no number; to be called before anything numeric is loaded."""
    for name in THREADS:
        os.environ.setdefault(name, "1")


def asked_threads() -> Mapping[str, str]:
    """The numbers of threads in this process, for processes elsewhere to have the same."""
    return {name: os.environ[name] for name in THREADS if name in os.environ}
