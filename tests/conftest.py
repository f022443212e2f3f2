"""What pytest sets up before any test: no display, one BLAS thread, the same property tests."""

from __future__ import annotations

import os

os.environ.setdefault("MPLBACKEND", "Agg")
# Before numpy is imported: BLAS threads would wait for work on the cores of our own threads, which
# makes small matrices tens of times slower on a busy machine.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

settings.register_profile("spinsdw", derandomize=True, deadline=None)
settings.load_profile("spinsdw")


@pytest.fixture(autouse=True)
def _thread_small_transforms_too(monkeypatch):
    """Tests are small; threads must be in them all the same, as they are in large transforms."""
    monkeypatch.setattr("spinsdw.parallel._LEAST_BANDLIMIT", 0)
