"""What a skilled user of other packages would call for the same results: the peers of the timings.

Each function packs its input the way the peer likes it and returns a callable without arguments
that does the work and nothing else. Packing, and putting a peer's results together, is not timed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import ducc0
import numpy as np

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.ring_transform import HealpixTransform
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.wavelet_transform import SpinWaveletTransform

__all__ = [
    "ducc0_adjoint_healpix",
    "ducc0_analysis",
    "ducc0_healpix",
    "ducc0_synthesis",
    "ducc0_wavelet_analysis",
    "ducc0_wavelet_synthesis",
    "m_major",
    "pack_flm",
    "pys2let_analysis",
    "pys2let_synthesis",
    "scale_orders",
]

Array = np.ndarray[Any, Any]
Call = Callable[[], Any]


_GEOMETRIES = {"mw": "MW", "gl": "GL"}


def m_major(bandlimit: int) -> tuple[Array, Array]:
    """Return degree and order of each coefficient the way ducc stores them: m >= 0, l fastest."""
    m = np.repeat(np.arange(bandlimit), bandlimit - np.arange(bandlimit))
    el = np.concatenate([np.arange(first, bandlimit) for first in range(bandlimit)])
    return el, m


def pack_flm(flm: Array, spin: int) -> Array:
    """Return the pair of real fields a, b that ducc takes for a complex field of spin >= 0.

    f_lm = -(a_lm + i b_lm) for spin > 0; for spin 0 the real and the imaginary part, without sign.
    """
    el, m = m_major(int(np.sqrt(flm.size)))
    here = flm[el**2 + el + m]
    there = (-1.0) ** m * flm[el**2 + el - m].conj()
    pair = np.stack([here + there, -1j * (here - there)]) / 2
    return -pair if spin > 0 else pair


def scale_orders(transform: SpinWaveletTransform, scale: int) -> list[int]:
    """Return the orders n of a scale that a composition transforms: of real signals n >= 0."""
    bandlimit = transform.bandlimits[scale]
    orders = transform.wavelets.directionality.orders
    return [n for n in orders if abs(n) < bandlimit and (n >= 0 or not transform.real)]


def _order_flm(transform: SpinWaveletTransform, flm: Array, scale: int, n: int) -> Array:
    """Harmonic coefficients, of spin |n|, of W_n for n <= 0 and of conj(W_n) for n > 0.

    W_n = sum_lm f_lm conj(psi_ln) d^l_mn e^{i m alpha} has spin -n, its conjugate spin n.
    """
    bandlimit = transform.bandlimits[scale]
    psi = transform.wavelets.wavelet_harmonics(scale)
    row = psi[transform.wavelets.directionality.orders.index(n), :bandlimit]
    el = np.arange(bandlimit)
    factor = np.repeat((-1.0) ** n * np.sqrt(4 * np.pi / (2 * el + 1)) * row.conj(), 2 * el + 1)
    values = factor * flm[: bandlimit**2]
    if n <= 0:
        return values
    el = np.repeat(el, 2 * el + 1)
    m = np.arange(bandlimit**2) - el**2 - el
    return (-1.0) ** (n + m) * values[el**2 + el - m].conj()


def _order_map(transform: SpinWaveletTransform, values: Array, n: int) -> Array:
    """W_n for n <= 0 or conj(W_n) from the maps of all orientations, as two real maps."""
    phases = np.exp(-1j * n * transform.orientations) / transform.directions
    found = np.tensordot(phases, values, 1)
    return np.stack([found.real, -found.imag if n > 0 else found.imag])


def _spin_calls(pair: Array, spin: int, *, is_real: bool) -> list[tuple[Array, int]]:
    """Split what ducc does in one call for spin > 0 and in two for a complex field of spin 0."""
    if spin > 0:
        return [(pair, spin)]
    return [(pair[k : k + 1], 0) for k in range(1 if is_real else 2)]


def ducc0_wavelet_analysis(transform: SpinWaveletTransform, flm: Array, *, threads: int) -> Call:
    """Harmonic to wavelet: one synthesis of spin |n| for each scale and order.

    The scaling part and the sum over orders into orientations are left out.
    """
    calls = []
    for scale in transform.scales:
        rings, points = transform.shapes[scale][1:]
        for n in scale_orders(transform, scale):
            pair = pack_flm(_order_flm(transform, flm, scale, n), abs(n))
            for alm, spin in _spin_calls(pair, abs(n), is_real=transform.real):
                sizes = {"lmax": transform.bandlimits[scale] - 1, "ntheta": rings, "nphi": points}
                calls.append({"alm": alm, "spin": spin, **sizes})
    return lambda: [
        ducc0.sht.synthesis_2d(
            **call, geometry=_GEOMETRIES[transform.sampling.name], nthreads=threads
        )
        for call in calls
    ]


def ducc0_wavelet_synthesis(
    transform: SpinWaveletTransform, coefficients: WaveletCoefficients, *, threads: int
) -> Call:
    """Wavelet to harmonic: one analysis of spin |n| for each scale and order.

    The sum over orientations into orders and that over scales and orders are left out.
    """
    calls = []
    for scale in transform.scales:
        for n in scale_orders(transform, scale):
            pair = _order_map(transform, coefficients[scale], n)
            for maps, spin in _spin_calls(pair, abs(n), is_real=transform.real):
                lmax = transform.bandlimits[scale] - 1
                calls.append({"map": np.ascontiguousarray(maps), "spin": spin, "lmax": lmax})
    return lambda: [
        ducc0.sht.analysis_2d(
            **call, geometry=_GEOMETRIES[transform.sampling.name], nthreads=threads
        )
        for call in calls
    ]


def ducc0_rotation(
    transform: SpinHarmonicTransform, flm: Array, rotation: tuple[float, ...], *, threads: int
) -> Call:
    """One real field, or the two that a complex one is."""
    alm = np.ascontiguousarray(pack_flm(flm, transform.spin)[: 1 if transform.real else 2])
    lmax = transform.bandlimit - 1
    return lambda: ducc0.sht.rotate_alm(alm, lmax, *rotation[::-1], nthreads=threads)


def ducc0_points(
    transform: SpinHarmonicTransform, flm: Array, points: Array, accuracy: float, *, threads: int
) -> Call:
    """Synthesis at points."""
    alm = np.ascontiguousarray(pack_flm(flm, transform.spin)[: 1 if transform.real else 2])
    return lambda: ducc0.sht.synthesis_general(
        alm=alm,
        spin=transform.spin,
        lmax=transform.bandlimit - 1,
        loc=points,
        epsilon=accuracy,
        nthreads=threads,
    )


def ducc0_adjoint_points(
    transform: SpinHarmonicTransform, values: Array, points: Array, accuracy: float, *, threads: int
) -> Call:
    """Adjoint of `ducc0_points`."""
    maps = _as_real_maps(values, is_real=transform.real)
    return lambda: ducc0.sht.adjoint_synthesis_general(
        map=maps,
        spin=transform.spin,
        lmax=transform.bandlimit - 1,
        loc=points,
        epsilon=accuracy,
        nthreads=threads,
    )


def ducc0_synthesis(transform: SpinHarmonicTransform, flm: Array, *, threads: int) -> Call:
    """Spin 0 of a real map, or spin 2 of (Q, U), on the transform's grid."""
    rings, points = transform.shape
    alm = np.ascontiguousarray(pack_flm(flm, transform.spin)[: 1 if transform.real else 2])
    return lambda: ducc0.sht.synthesis_2d(
        alm=alm,
        spin=transform.spin,
        lmax=transform.bandlimit - 1,
        geometry=_GEOMETRIES[transform.sampling.name],
        ntheta=rings,
        nphi=points,
        nthreads=threads,
    )


def _as_real_maps(maps: Array, *, is_real: bool) -> Array:
    return np.ascontiguousarray(maps[None] if is_real else np.stack([maps.real, maps.imag]))


def ducc0_analysis(transform: SpinHarmonicTransform, maps: Array, *, threads: int) -> Call:
    """Inverse of `ducc0_synthesis`."""
    values = _as_real_maps(maps, is_real=transform.real)
    return lambda: ducc0.sht.analysis_2d(
        map=values,
        spin=transform.spin,
        lmax=transform.bandlimit - 1,
        geometry=_GEOMETRIES[transform.sampling.name],
        nthreads=threads,
    )


def _healpix_geometry(nside: int) -> dict[str, Array]:
    geometry: dict[str, Array] = ducc0.healpix.Healpix_Base(nside, "RING").sht_info()
    return geometry


def ducc0_healpix(transform: HealpixTransform, flm: Array, *, threads: int) -> Call:
    """Synthesis on the rings of HEALPix."""
    geometry = _healpix_geometry(transform.nside)
    alm = np.ascontiguousarray(pack_flm(flm, transform.spin)[: 1 if transform.real else 2])
    lmax = transform.bandlimit - 1
    return lambda: ducc0.sht.synthesis(
        alm=alm, spin=transform.spin, lmax=lmax, nthreads=threads, **geometry
    )


def ducc0_adjoint_healpix(transform: HealpixTransform, maps: Array, *, threads: int) -> Call:
    """Adjoint of `ducc0_healpix`: sums over pixels without weights."""
    geometry = _healpix_geometry(transform.nside)
    values = _as_real_maps(maps, is_real=transform.real)
    lmax = transform.bandlimit - 1
    return lambda: ducc0.sht.adjoint_synthesis(
        map=values, spin=transform.spin, lmax=lmax, nthreads=threads, **geometry
    )


def _s2let_arguments(transform: SpinWaveletTransform) -> tuple[float, int, int, int, int, int]:
    """Return the peer's B, L, J_min, N, spin and upsample."""
    return (
        transform.dilation,
        transform.bandlimit,
        transform.lowest_scale,
        transform.directions,
        transform.spin,
        0 if transform.multiresolution else 1,
    )


def pys2let_analysis(transform: SpinWaveletTransform, maps: Array) -> Call:
    """Map to wavelet, with 2N - 1 orientations; the package has one thread."""
    import pys2let

    values, arguments = maps.ravel().astype(complex), _s2let_arguments(transform)
    return lambda: pys2let.analysis_px2wav(values, *arguments)


def pys2let_synthesis(transform: SpinWaveletTransform, maps: Array) -> Call:
    """Wavelet to map, of the coefficients that `pys2let_analysis` finds."""
    import pys2let

    wavelets, scaling = pys2let_analysis(transform, maps)()
    arguments = _s2let_arguments(transform)
    return lambda: pys2let.synthesis_wav2px(wavelets, scaling, *arguments)
