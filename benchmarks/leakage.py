"""How much E leaks into B behind a mask, and how faithful B is: the tables of docs/partial_sky.

Skies have the spectra of Planck 2018: E alone (unlensed, no B) and B alone (tensors at r = 1, no
E). With Bhat_j the band of scale j of what a method returns, and R the pixels farther than d from
the edge of the observed sky,

    leakage  = sum_R Bhat_j^2 of the E-only skies / sum_R Bhat_j^2 of the B-only skies,
    fidelity = correlation over R of Bhat_j and the band of the true B, on the B-only skies,

with sums over all skies. The leakage is in units of r and blind to the normalisation of a method:
1e-3 hides a signal of r = 0.001. Every method is judged on the same R.

Run it as ``python benchmarks/leakage.py``; it prints reStructuredText. It takes a few minutes.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from importlib.metadata import version

import healpy as hp
import numpy as np

from spinsdw import EBSeparator, ScaleDiscretisedTiling
from spinsdw.datasets import planck2018_spectra, wmap_mask_path
from spinsdw.harmonics import multiply_by_degree
from spinsdw.healpix import alm_to_flm, flm_to_map
from spinsdw.maps_io import read_mask
from spinsdw.masks import distance_to_edge, galactic_cut, upgrade
from spinsdw.separation import Pseudo
from spinsdw.simulation import simulate_eb, simulate_qu

BEAM = np.radians(2)
LOWEST_SCALE = 2
DISTANCES = (1, 3, 10)
TAPERS = (0.05, 0.2, 0.5)
DIRECTIONS = (1, 3)

Bands = dict[int, np.ndarray]
Method = Callable[[np.ndarray, np.ndarray], Bands]


def bands_of(b_lm: np.ndarray, nside: int) -> Bands:
    """Cut a scalar field into the bands kappa_j^2 of the wavelets."""
    bandlimit = 2 * nside + 1
    tiling = ScaleDiscretisedTiling(bandlimit, lowest_scale=LOWEST_SCALE)
    return {
        j: flm_to_map(multiply_by_degree(b_lm, tiling.kernel(j) ** 2), nside, real=True)
        for j in tiling.scales
    }


def masked_map2alm(mask: np.ndarray) -> Method:
    nside = hp.npix2nside(mask.size)

    def bands(q: np.ndarray, u: np.ndarray) -> Bands:
        alm = hp.map2alm([0 * q, mask * q, mask * u], lmax=2 * nside, pol=True, iter=3)
        return bands_of(alm_to_flm(alm[2], 2 * nside + 1), nside)

    return bands


def pseudo(mask: np.ndarray, directions: int, taper: float) -> Method:
    separator = EBSeparator(
        mask=mask, directions=directions, method=Pseudo(taper), lowest_scale=LOWEST_SCALE
    )

    def bands(q: np.ndarray, u: np.ndarray) -> Bands:
        found = separator.bands(separator.separate(q, u))
        return {j: eb[1] for j, eb in found.items() if j != "scaling"}

    return bands


def methods_for(mask: np.ndarray) -> dict[str, Method]:
    methods = {"masked ``map2alm``": masked_map2alm(mask)}
    for directions in DIRECTIONS:
        for taper in TAPERS:
            methods[f"N = {directions}, taper {taper}"] = pseudo(mask, directions, taper)
    return methods


def skies(nside: int, count: int) -> Iterator[tuple[tuple, tuple, Bands]]:
    """Yield Q, U of E alone, Q, U of B alone, and the bands of that B, for the seeds 0, 1, ..."""
    spectra, bandlimit = planck2018_spectra(), 2 * nside + 1
    none = np.zeros(bandlimit)
    for seed in range(count):
        kinds = (spectra["EE_unlensed"], none), (none, spectra["BB_tensor"])
        e_only, b_only = (
            simulate_eb(*kind, bandlimit, seed=seed, beam_fwhm=BEAM) for kind in kinds
        )
        yield simulate_qu(*e_only, nside), simulate_qu(*b_only, nside), bands_of(b_only[1], nside)


def measure(mask: np.ndarray, count: int) -> tuple[dict, dict]:
    """Return leakage and fidelity by (method, distance, scale), and the share of R by distance."""
    nside, depth = hp.npix2nside(mask.size), distance_to_edge(mask)
    regions = {d: depth > np.radians(d) for d in DISTANCES}
    sums: dict[tuple, np.ndarray] = {}
    methods = methods_for(mask)
    for e_only, b_only, truth in skies(nside, count):
        for name, method in methods.items():
            leaked, found = method(*e_only), method(*b_only)
            for d, region in regions.items():
                for j, true in truth.items():
                    one, two, three = leaked[j][region], found[j][region], true[region]
                    products = one @ one, two @ two, three @ three, two @ three
                    key = name, d, j
                    sums[key] = sums.get(key, 0) + np.array(products)
    results = {
        key: (leak / kept, cross / np.sqrt(kept * true)) if kept else None
        for key, (leak, kept, true, cross) in sums.items()
    }
    return results, {d: region.mean() for d, region in regions.items()}


def cell(result: tuple[float, float] | None) -> str:
    """Write 0.0123, 0.95 as "1e-2 .95", and "none" where nothing was kept."""
    if result is None:
        return "none"
    leakage, fidelity = result
    mantissa, exponent = f"{leakage:.0e}".split("e")
    return f"{mantissa}e{int(exponent)} " + f"{fidelity:.2f}".removeprefix("0")


def table(title: str, results: dict, shares: dict[int, float]) -> str:
    """Write the results for one mask as a simple table, without regions that have no pixel."""
    scales = sorted({j for _, _, j in results})
    names = list(dict.fromkeys(name for name, _, _ in results))
    regions = {d: share for d, share in shares.items() if share}
    rows = [["*d* >", "method", *(f"l = {2**j}" for j in scales)]]
    for d in regions:
        for name in names:
            rows.append([f"{d}°", name, *(cell(results[name, d, j]) for j in scales)])
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    rule = "  ".join("=" * width for width in widths)
    text = [
        "  ".join(value.ljust(width) for value, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    share = ", ".join(f"{share:.0%} for *d* > {d}°" for d, share in regions.items())
    lines = [rule, text[0], rule, *text[1:], rule]
    return "\n".join([f".. table:: {title}; {share}", "", *(f"   {line}" for line in lines)])


def footer(nside: int, count: int) -> str:
    packages = ", ".join(f"{name} {version(name)}" for name in ("spinsdw", "healpy", "numpy"))
    return (
        f"HEALPix with nside {nside}, bandlimit {2 * nside + 1}, a Gaussian beam of 2°, no noise; "
        f"{count} skies of each kind, seeds 0 to {count - 1}; dilation 2, lowest scale 2; "
        f"{packages}."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--nside", type=int, default=64)
    parser.add_argument("--skies", type=int, default=10)
    choices = parser.parse_args()
    masks = {
        "Galactic cut of 20°": galactic_cut(choices.nside, np.radians(20)),
        "WMAP seven-year temperature mask": upgrade(read_mask(wmap_mask_path()), choices.nside),
    }
    for name, mask in masks.items():
        print(table(f"{name}, {mask.mean():.0%} of the sky", *measure(mask, choices.skies)))
        print()
    print(footer(choices.nside, choices.skies))


if __name__ == "__main__":
    main()
