"""What pytest sets up before any test: no display, and the same property tests on every run."""

from __future__ import annotations

import os

os.environ.setdefault("MPLBACKEND", "Agg")

from hypothesis import settings

settings.register_profile("spinsdw", derandomize=True, deadline=None)
settings.load_profile("spinsdw")
