"""The benchmarks compare like with like, and their report says what was measured."""

from __future__ import annotations

import importlib
import json
from pathlib import Path

import numpy as np
import pytest

from spinsdw.ring_transform import HealpixTransform
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import assert_close, random_flm, random_real_flm, sizes

pytest.importorskip("matplotlib")

ROOT = Path(__file__).parents[1]

with pytest.MonkeyPatch.context() as patch:
    patch.syspath_prepend(ROOT / "benchmarks")
    peers = importlib.import_module("peers")
    report = importlib.import_module("report")
    timing = importlib.import_module("timing")

each_signal = pytest.mark.parametrize(("spin", "real"), [(2, False), (0, False), (0, True)])
each_timed_signal = pytest.mark.parametrize(("spin", "real"), [(2, False), (0, True)])
each_size = pytest.mark.parametrize("bandlimit", sizes(8, 13, 32))


def make_flm(bandlimit, spin, real):
    return random_real_flm(bandlimit) if real else random_flm(bandlimit, spin)


def complex_flm(pair, spin, bandlimit):
    """f_lm = -+(a_lm + i b_lm) of a pair of real fields in ducc's order, undoing `pack_flm`."""
    el, m = peers.m_major(bandlimit)
    a, b = pair
    sign = -1 if spin > 0 else 1
    flm = np.empty(bandlimit**2, dtype=complex)
    flm[el**2 + el - m] = sign * (-1.0) ** m * (a - 1j * b).conj()
    flm[el**2 + el + m] = sign * (a + 1j * b)
    return flm


def by_order(transform, found):
    """Yield scale, n and the pair of maps or coefficients that a composition found for them."""
    found = iter(found)
    for scale in transform.scales:
        for n in peers.scale_orders(transform, scale):
            first = next(found)
            if n == 0:
                second = 0 * first if transform.real else next(found)
                yield scale, n, np.concatenate([first, second])
            else:
                yield scale, n, first


@each_size
@each_signal
@pytest.mark.parametrize("directions", [1, 2, 3])
def test_composed_analysis_finds_our_coefficients(bandlimit, spin, real, directions):
    """W_n = (1/N) sum_k e^{-i n gamma_k} W(gamma_k), of which ducc finds W_n or its conjugate."""
    transform = SpinWaveletTransform(bandlimit, spin, directions, real=real, threads=1)
    flm = make_flm(bandlimit, spin, real)
    coefficients = transform.analysis_harmonic(flm)
    found = peers.ducc0_wavelet_analysis(transform, flm, threads=1)()
    for scale, n, (q, u) in by_order(transform, found):
        phases = np.exp(-1j * n * transform.orientations) / directions
        ours = np.tensordot(phases, coefficients[scale], 1)
        peer = q - 1j * u if n > 0 else q + 1j * u
        scale_of_all = np.max(np.abs(coefficients[scale]), initial=1.0)
        assert_close(np.append(ours, scale_of_all), np.append(peer, scale_of_all), 16 * bandlimit)


@each_size
@each_signal
@pytest.mark.parametrize("directions", [1, 2, 3])
def test_composed_synthesis_finds_our_harmonics(bandlimit, spin, real, directions):
    """f_lm = sum_{j,n} W^j_lmn psi^j_ln, of real signals twice the real part for n > 0."""
    transform = SpinWaveletTransform(bandlimit, spin, directions, real=real, threads=1)
    coefficients = transform.analysis_harmonic(make_flm(bandlimit, spin, real))
    coefficients = coefficients * {j: float(1 + j) for j in transform.scales}
    alms = peers.ducc0_wavelet_synthesis(transform, coefficients, threads=1)()
    total = np.zeros(bandlimit**2, dtype=complex)
    for scale, n, pair in by_order(transform, alms):
        size = transform.bandlimits[scale]
        el = np.repeat(np.arange(size), 2 * np.arange(size) + 1)
        m = np.arange(size**2) - el**2 - el
        flm = complex_flm(pair, abs(n), size)
        if n > 0:
            flm = (-1.0) ** (n + m) * flm[el**2 + el - m].conj()
        row = transform.wavelets.directionality.orders.index(n)
        psi = transform.wavelets.wavelet_harmonics(scale)[row, el]
        # The map of order n is (-1)^n sqrt(4 pi / (2l + 1)) (2l + 1) / (8 pi^2) W_lmn.
        part = (-1.0) ** n * flm * psi * 8 * np.pi**2 / np.sqrt(4 * np.pi * (2 * el + 1))
        total[: size**2] += part
        if real and n > 0:
            total[: size**2] += (-1.0) ** m * part[el**2 + el - m].conj()
    parts = transform.scales
    desired = transform.synthesis_harmonic(coefficients, parts=parts)
    total[: spin**2] = 0
    assert_close(total, desired, 32 * bandlimit)


@each_size
@each_timed_signal
def test_spin_transforms_are_those_of_the_peer(bandlimit, spin, real):
    transform = SpinHarmonicTransform(bandlimit, spin, real=real, threads=1)
    flm = make_flm(bandlimit, spin, real)
    maps = transform.synthesis(flm)
    found = peers.ducc0_synthesis(transform, flm, threads=1)()
    assert_close(found[0] if real else found[0] + 1j * found[1], maps, 16 * bandlimit)
    pair = peers.ducc0_analysis(transform, maps, threads=1)()
    pair = np.concatenate([pair, 0 * pair]) if real else pair
    assert_close(complex_flm(pair, spin, bandlimit), flm, 16 * bandlimit)


@each_timed_signal
def test_healpix_transforms_are_those_of_the_peer(spin, real):
    """The peer's adjoint is that of its own pairing: of -(a + ib) for spin 2."""
    transform = HealpixTransform(4, 9, spin, real=real, threads=1)
    flm = make_flm(9, spin, real)
    maps = transform.synthesis(flm)
    found = peers.ducc0_healpix(transform, flm, threads=1)()
    assert_close(found[0] if real else found[0] + 1j * found[1], maps, 64 * 9)
    pair = peers.ducc0_adjoint_healpix(transform, maps, threads=1)()
    pair = np.concatenate([pair, 0 * pair]) if real else pair
    desired = transform.adjoint_synthesis(maps)
    assert_close(complex_flm(pair, spin, 9), desired, 64 * 9)


def test_callables_take_turns_and_turn_about():
    """Round 0 runs forwards, round 1 backwards, and so on."""
    called = []
    calls = {name: lambda name=name: called.append(name) for name in "ab"}
    found = timing.best_of(calls, fewest=3, most=3)
    assert "".join(called) == "abbaab"
    assert found.rounds == 3
    assert found.best["a"] == min(found.seconds["a"])
    assert found.ratio("a", "b") == found.best["a"] / found.best["b"]


def test_growth_of_a_cube_has_exponent_three():
    """log(5 L^3) is a line of slope 3 over log L."""
    size = np.array([128.0, 256.0, 1024.0])
    assert report.growth_exponent(size, 5 * size**3) == pytest.approx(3.0, abs=1e-12)


def test_a_peer_that_is_faster_is_named():
    what = {"signal": "spin 2", "direction": "synthesis", "L": 64, "threads": 1, "rounds": 4}
    row = {**what, "seconds": {"spinsdw": 3.0, "ducc0": 2.0}, "median": {}}
    job = {"plan": "full", "date": "2026-01-01", "revision": "x", "load": 0.0, "rows": [row]}
    machine = {"cpu": "", "cores": 2, "vector_width": 8, "system": "", "python": "", "versions": {}}
    text = report.tables({"machine": machine, "jobs": {"harmonic": job}})
    assert "- spin synthesis, spin 2, 1 thread, against ducc0: 1.50 at L = 64." in text
    assert "**0.67**" in text


def test_the_page_shows_the_results_that_are_kept():
    """docs/performance_tables.inc is what `report` makes of benchmarks/results.json."""
    results = json.loads((ROOT / "benchmarks/results.json").read_text(encoding="utf-8"))
    page = (ROOT / "docs/performance_tables.inc").read_text(encoding="utf-8")
    assert report.tables(results) == page
