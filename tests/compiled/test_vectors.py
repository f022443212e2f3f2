"""The explicit vector loops against the plain ones that define them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from spinsdw.compiled import vectors
from spinsdw.compiled.jit import cache_directory
from spinsdw.spin_transform import SpinHarmonicTransform
from tests.helpers import EPS, IS_UNCOMPILED, assert_close, needs_compiler, random_flm

ROOT = Path(__file__).parents[2]
# doubles in a vector, vectors of rings: what each kind of processor uses, and one vector alone.
SHAPES = [(2, 2), (4, 2), (8, 4), (2, 1)]


def compiled(tile):
    """Return a function that calls an intrinsic, which only compiled code can."""

    @numba.njit
    def call(a, b, c, x, before, now, sums, first, pairs):
        tile(a, b, c, x, before, now, sums, first, pairs)

    return call


def problem(columns, rings, sums, seed=0):
    """Draw arrays for degrees below 40; |a x + b| < 2, so that the recursion does not grow."""
    rng = np.random.default_rng(seed)
    degrees = 40
    a, b = rng.uniform(0.5, 1.5, degrees), rng.uniform(-0.3, 0.3, degrees)
    c = rng.standard_normal(degrees * columns)
    x = rng.uniform(-1, 1, rings)
    before, now = rng.standard_normal(rings), rng.standard_normal(rings)
    return a, b, c, x, before, now, rng.standard_normal(sums)


def run(tile, arguments, first, pairs):
    """Call a tile on copies; return what it changes: before, now, sums."""
    copies = [values.copy() for values in arguments]
    tile(*copies, first, pairs)
    for i in range(4):
        assert np.array_equal(copies[i], arguments[i])
    return copies[4:]


def assert_same(found, desired, terms):
    """Only multiply-adds may differ, rounded once or twice: an ulp for each of the terms."""
    for one, other in zip(found, desired, strict=True):
        assert_close(one, other, ulps=16 * terms)


@needs_compiler
@pytest.mark.parametrize("columns", [0, 2, 4])
@pytest.mark.parametrize(("width", "count"), SHAPES)
def test_ring_tiles_are_the_plain_sums_over_degrees(width, count, columns):
    """sums[k, r] += sum_l c[l, k] u_l(x_r), and the recursion moved on."""
    rings = width * count
    tile = compiled(vectors._make_ring_tile(count, columns, width))
    plain = vectors._make_plain_ring_tile(rings, columns)
    arguments = problem(max(columns, 1), rings, max(columns, 1) * rings)
    for first, pairs in ((0, 0), (0, 1), (3, 8), (1, 19)):
        found, desired = (run(one, arguments, first, pairs) for one in (tile, plain))
        assert_same(found, desired, 2 * pairs + 1)


@needs_compiler
@pytest.mark.parametrize("columns", [2, 4])
@pytest.mark.parametrize(("width", "count"), SHAPES)
def test_degree_tiles_are_the_plain_sums_over_rings(width, count, columns):
    """sums[l, k, lane] += sum_r g[k, r] u_l(x_r) over the rings of each lane."""
    rings = width * count
    tile = compiled(vectors._make_degree_tile(count, columns, width))
    plain = vectors._make_plain_degree_tile(rings, columns, width)
    a, b, _, x, before, now, sums = problem(columns, rings, 40 * columns * width)
    g = np.random.default_rng(1).standard_normal(columns * rings)
    for first, pairs in ((0, 0), (0, 1), (3, 8), (1, 19)):
        arguments = (a, b, g, x, before, now, sums)
        found, desired = (run(one, arguments, first, pairs) for one in (tile, plain))
        assert_same(found, desired, 2 * pairs + 1)


@needs_compiler
@pytest.mark.parametrize("width", [1, 2, 4, 8])
def test_lanes_are_added_in_the_order_of_the_plain_form(width):
    values = np.random.default_rng(0).standard_normal(24)
    lane_sum = vectors._make_lane_sum(width)

    @numba.njit
    def call(sums, place):
        return lane_sum(sums, place)

    plain = vectors._make_plain_lane_sum(width)
    for place in range(values.size - width):
        assert call(values, place) == plain(values, place)
        assert_close(plain(values, place), values[place : place + width].sum(), ulps=16)


@pytest.mark.parametrize("columns", [2, 4])
def test_the_two_plain_sums_are_adjoint(columns):
    """<sum_l c u, g> over rings = <c, sum_r g u> over degrees, the lanes added up."""
    rings, width, pairs = 8, 4, 20
    a, b, c, x, before, now, _ = problem(columns, rings, 0)
    g = np.random.default_rng(1).standard_normal(columns * rings)
    over_degrees = np.zeros(columns * rings)
    tile = vectors._make_plain_ring_tile(rings, columns)
    tile(a, b, c, x, before.copy(), now.copy(), over_degrees, 0, pairs)
    over_rings = np.zeros(40 * columns * width)
    tile = vectors._make_plain_degree_tile(rings, columns, width)
    tile(a, b, g, x, before.copy(), now.copy(), over_rings, 0, pairs)
    left = over_degrees @ g
    right = c @ over_rings.reshape(-1, width).sum(axis=1)
    assert abs(left - right) <= 64 * EPS * np.linalg.norm(over_degrees) * np.linalg.norm(g)


def test_a_tile_is_a_whole_number_of_vectors():
    assert vectors.WIDTH in {2, 4, 8}
    assert vectors.RINGS == vectors.VECTORS * vectors.WIDTH


@pytest.mark.parametrize("setting", ["2", "4", "8"])
def test_width_may_be_set(setting, monkeypatch):
    monkeypatch.setenv("SPINSDW_VECTOR_WIDTH", setting)
    assert vectors._host_width() == int(setting)


@pytest.mark.parametrize("setting", ["", "3", "16", "wide"])
def test_other_settings_leave_the_width_to_the_machine(setting, monkeypatch):
    monkeypatch.delenv("SPINSDW_VECTOR_WIDTH", raising=False)
    own = vectors._host_width()
    monkeypatch.setenv("SPINSDW_VECTOR_WIDTH", setting)
    assert vectors._host_width() == own


@pytest.mark.parametrize(
    ("features", "width"),
    [("+sse2,+avx,+avx2,+avx512f", 8), ("+sse2,+avx", 4), ("+sse2", 2), ("+neon", 2), ("", 2)],
)
def test_width_follows_the_processor_compiled_for(features, width, monkeypatch):
    monkeypatch.delenv("SPINSDW_VECTOR_WIDTH", raising=False)
    monkeypatch.setattr(vectors.config, "CPU_NAME", "generic")
    monkeypatch.setattr(vectors.config, "CPU_FEATURES", features)
    assert vectors._host_width() == width


SCRIPT = """
import sys
import numpy as np
from spinsdw.spin_transform import SpinHarmonicTransform
transform = SpinHarmonicTransform(int(sys.argv[2]), 2, threads=1)
with np.load(sys.argv[1]) as given:
    flm, noise = given["flm"], given["noise"]
synthesis, adjoint = transform.synthesis(flm), transform.adjoint_synthesis(noise)
alone = transform.adjoint_synthesis(noise[0])
np.savez(sys.argv[1], flm=flm, noise=noise, synthesis=synthesis, adjoint=adjoint, alone=alone)
"""


def run_elsewhere(folder, bandlimit, **settings):
    """Transform two maps, and one alone, in a process of its own with these variables."""
    transform = SpinHarmonicTransform(bandlimit, 2)
    flm = random_flm(bandlimit, 2, batch=(2,))
    noise = transform.synthesis(random_flm(bandlimit, 2, seed=1, batch=(2,)))
    path = folder / "arrays.npz"
    np.savez(path, flm=flm, noise=noise)
    subprocess.run(
        [sys.executable, "-c", SCRIPT, path, str(bandlimit)],
        env=os.environ | settings,
        cwd=ROOT,
        check=True,
        timeout=300,
    )
    with np.load(path) as found:
        assert_close(found["synthesis"], transform.synthesis(flm), ulps=8 * bandlimit)
        adjoint = transform.adjoint_synthesis(noise)
        assert_close(found["adjoint"], adjoint, ulps=8 * bandlimit)
        assert_close(found["alone"], adjoint[0], ulps=8 * bandlimit)


@needs_compiler
@pytest.mark.parametrize("width", sorted({2, 4, 8} - {vectors.WIDTH}))
def test_results_do_not_depend_on_the_width(width, tmp_path):
    """Sums in another order, and multiply-adds fused or not: within 8 L ulps."""
    own = cache_directory()
    # Each width has a cache of its own: in one folder they would drive each other out.
    cache = "0" if own is None else str(own.parent / f"width-{width}")
    run_elsewhere(tmp_path, 40, SPINSDW_VECTOR_WIDTH=str(width), SPINSDW_CACHE=cache)


@pytest.mark.skipif(IS_UNCOMPILED, reason="compares with what it runs as")
def test_the_package_runs_without_compilation(tmp_path):
    run_elsewhere(tmp_path, 8, NUMBA_DISABLE_JIT="1")
