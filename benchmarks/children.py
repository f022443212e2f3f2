"""What is measured in a process of its own: start-up and memory. Prints one line of JSON.

Nothing but the standard library is imported at the top: the import itself is measured.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

__all__ = ["memory", "peak_bytes", "resident_bytes", "startup"]


def _status(key: str) -> int | None:
    """Return a line of /proc/self/status in bytes, None where there is no such file."""
    try:
        text = Path("/proc/self/status").read_text(encoding="ascii")
    except OSError:
        return None
    lines = dict(line.split(":", 1) for line in text.splitlines())
    return int(lines[key].split()[0]) * 1024


def peak_bytes() -> int:
    """Return the largest memory this process has had."""
    # Not ru_maxrss where this is known: a child inherits that of the process that started it.
    peak = _status("VmHWM")
    if peak is not None:
        return peak
    import resource

    found = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(found if sys.platform == "darwin" else found * 1024)


def resident_bytes() -> int:
    """Return the memory this process has now; its peak where that is all there is."""
    return _status("VmRSS") or peak_bytes()


def startup(bandlimit: int) -> dict[str, float]:
    """Return seconds of the import, of a first transform and of a second."""
    start = time.perf_counter()
    import spinsdw

    imported = time.perf_counter()
    transform = spinsdw.SpinWaveletTransform(bandlimit, 2, 3, threads=1)
    import numpy as np

    flm = np.ones(bandlimit**2, dtype=complex)
    loaded = time.perf_counter()
    transform.synthesis_harmonic(transform.analysis_harmonic(flm))
    first = time.perf_counter()
    transform.synthesis_harmonic(transform.analysis_harmonic(flm))
    second = time.perf_counter()
    return {
        "import": imported - start,
        "load": loaded - imported,
        "first": first - loaded,
        "second": second - first,
    }


def memory(case: dict) -> dict[str, float]:
    """Return bytes of input, output and the growth of this process to its peak."""
    import numpy as np

    from spinsdw import SpinWaveletTransform, WaveletCoefficients
    from spinsdw.grid_sums import LARGE_BANDLIMIT

    rng = np.random.default_rng(0)
    options = {key: case[key] for key in ("dtype", "threads") if key in case}
    small = SpinWaveletTransform(8, 2, case["N"], **options)
    small.synthesis_harmonic(small.analysis_harmonic(np.zeros(64, dtype=complex)))
    # Large grids have compiled loops of their own: they must not be compiled while memory counts.
    if case["L"] >= LARGE_BANDLIMIT:
        other = SpinWaveletTransform(LARGE_BANDLIMIT, 2, **options)
        flm = np.zeros(LARGE_BANDLIMIT**2, dtype=complex)
        other.synthesis_harmonic(other.analysis_harmonic(flm))
    transform = SpinWaveletTransform(case["L"], 2, case["N"], **options)

    def drawn(shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
        """Fill an array in place: a temporary array would count as ours."""
        values = np.empty(shape, dtype=dtype)
        parts = values.reshape(-1).view(values.real.dtype)
        rng.standard_normal(out=parts, dtype=parts.dtype)
        return values

    before = resident_bytes()
    given: object
    is_analysis = case["direction"] == "harmonic to wavelet"
    method = "analysis_harmonic" if is_analysis else "synthesis_harmonic"
    if is_analysis:
        given = drawn((case["L"] ** 2,), np.dtype(complex))
        found = transform.analysis_harmonic(given)
    else:
        like = small.analysis_harmonic(np.zeros(64, dtype=complex))
        parts = {key: drawn(shape, like.scaling.dtype) for key, shape in transform.shapes.items()}
        scaling = parts.pop("scaling")
        parameters = {**like.parameters, "bandlimit": case["L"]}
        given = WaveletCoefficients(scaling, parts, parameters)
        found = transform.synthesis_harmonic(given)
    return {
        "input": given.nbytes,
        "output": found.nbytes,
        "growth": peak_bytes() - before,
        "estimate": transform.memory_estimate()[method].peak,
    }


def main() -> None:
    name, argument = sys.argv[1:]
    call = {"startup": startup, "memory": memory}[name]
    print(json.dumps(call(json.loads(argument))))


if __name__ == "__main__":
    main()
