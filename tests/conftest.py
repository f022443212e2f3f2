"""What pytest sets up before any test: no display, and the same property tests on every run."""

from __future__ import annotations

import os

os.environ.setdefault("MPLBACKEND", "Agg")

import pytest
from hypothesis import settings

settings.register_profile("spinsdw", derandomize=True, deadline=None)
settings.load_profile("spinsdw")


@pytest.fixture(autouse=True)
def _thread_small_transforms_too(monkeypatch):
    """Tests are small; threads must be in them all the same, as they are in large transforms."""
    monkeypatch.setattr("spinsdw.parallel._LEAST_BANDLIMIT", 0)
