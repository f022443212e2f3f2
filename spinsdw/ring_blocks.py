"""A few rings of a HEALPix map between their Fourier columns and their pixels.

Rings of one length, those of the belt, are folded and transformed together. In a cap a transform's
plan costs as much as the transform, and a call from Python as well: many rings go in one call.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.fourier import fill_orders, fill_rings, from_series, to_series
from spinsdw.parity_engine import ParityEngine, mirrored_rings
from spinsdw.sampling.healpix_rings import HealpixRings

__all__ = ["BeltBlock", "CapBlock", "healpix_engine", "ring_blocks", "task_bytes"]

Array = np.ndarray[Any, Any]

# Complex numbers of the rings that one task transforms: they stay in a core's cache.
_TASK_SIZE = 2**15
# Columns are read by rings side by side: fewer would be less than two cache lines.
_FEWEST_RINGS = 8


def task_bytes(nside: int) -> int:
    """Return about how many bytes one task takes for each map."""
    return 16 * max(_TASK_SIZE, 4 * nside * _FEWEST_RINGS)


@functools.lru_cache(maxsize=32)
def healpix_engine(nside: int, bandlimit: int, order: int) -> ParityEngine:
    """Return the sums of one order on the rings of HEALPix."""
    half = mirrored_rings(HealpixRings(nside).colatitudes)
    return ParityEngine(bandlimit, half, (order,), clears=False)


@dataclass(frozen=True, eq=False)
class BeltBlock:
    """Neighbouring rings of ``points`` pixels each.

    Parameters
    ----------
    rings : ndarray of int64
        Their numbers.
    points : int
        Pixels of each.
    phis : ndarray of float64
        Longitudes of their first pixels.
    limits : ndarray of int64
        For each the number of orders m >= 0 that matter.
    pixels : slice
        Their pixels in a map.
    """

    rings: Array
    points: int
    phis: Array
    limits: Array
    pixels: slice

    def _rows(self, pixels: Array) -> Array:
        return pixels[:, self.pixels].reshape(len(pixels), self.rings.size, self.points)

    def _modes(
        self, maps: int, is_real: bool
    ) -> tuple[Array, tuple[Array, Array, Array, Array, Array]]:
        """Return room for the modes of all maps, and what tells where they lie."""
        count = self.points // 2 + 1 if is_real else self.points
        modes = np.empty((maps, self.rings.size, count), dtype=np.complex128)
        starts = count * np.arange(maps * self.rings.size).reshape(maps, -1)
        sizes = np.full_like(self.rings, self.points)
        return modes, (self.rings, sizes, self.phis, self.limits, starts)

    def fill_pixels(self, columns: Array, pixels: Array) -> None:
        """Fill these rings of maps (maps, all pixels) from columns (maps, m, all rings)."""
        from spinsdw.compiled.folding import fill_folded

        is_real = pixels.dtype == np.float64
        modes, geometry = self._modes(len(pixels), is_real)
        fill_folded(columns, *geometry, is_real, modes.reshape(-1))
        from_series(modes, self._rows(pixels))

    def fill_columns(self, pixels: Array, columns: Array) -> None:
        """Fill these rings of the columns from those of the maps: the adjoint."""
        from spinsdw.compiled.folding import fill_unfolded

        is_real = pixels.dtype == np.float64
        modes, geometry = self._modes(len(pixels), is_real)
        to_series(self._rows(pixels), modes)
        fill_unfolded(modes.reshape(-1), *geometry, is_real, columns)


@dataclass(frozen=True, eq=False)
class CapBlock:
    """Rings of the caps, each next to its mirror image.

    Parameters
    ----------
    rings : ndarray of int64
        Their numbers.
    sizes, starts : ndarray of uint64
        Pixels of each, and its first pixel in a map.
    phis, limits : ndarray
        As those of `BeltBlock`.
    """

    rings: Array
    sizes: Array
    starts: Array
    phis: Array
    limits: Array

    def _orders(self, maps: int) -> Array:
        shape = (maps, self.rings.size, int(self.limits.max()))
        return np.empty(shape, dtype=np.complex128)

    def _parts(self, pixels: Array, orders: Array) -> Iterator[tuple[Array, Array]]:
        """Give real maps (., pixels) and their orders: those of a complex map lie interleaved."""
        if pixels.dtype == np.float64:
            yield pixels, orders
            return
        for i, values in enumerate(pixels):
            yield values.view(np.float64).reshape(-1, 2).T, orders[2 * i : 2 * i + 2]

    def fill_pixels(self, columns: Array, pixels: Array) -> None:
        """Fill these rings of maps (maps, all pixels) from columns (maps, m, all rings)."""
        from spinsdw.compiled.folding import split_orders

        is_real = pixels.dtype == np.float64
        orders = self._orders(len(pixels) * (1 if is_real else 2))
        split_orders(columns, self.rings, self.limits, is_real, orders)
        for real_maps, series in self._parts(pixels, orders):
            fill_rings(series, real_maps, self.sizes, self.phis, self.starts)

    def fill_columns(self, pixels: Array, columns: Array) -> None:
        """Fill these rings of the columns from those of the maps: the adjoint."""
        from spinsdw.compiled.folding import join_orders

        is_real = pixels.dtype == np.float64
        orders = self._orders(len(pixels) * (1 if is_real else 2))
        for real_maps, series in self._parts(pixels, orders):
            fill_orders(real_maps, series, self.sizes, self.phis, self.starts)
        join_orders(orders, self.rings, self.limits, is_real, columns)


def _cap_groups(nside: int, limits: Array) -> Iterator[Array]:
    """Split the rings of both caps, each next to its mirror image, whose plan it shares."""
    rings: list[int] = []
    for first in range(nside - 1):
        rings += [first, 4 * nside - 2 - first]
        if 2 * int(limits[first]) * len(rings) >= _TASK_SIZE or first == nside - 2:
            yield np.array(rings)
            rings = []


def _belt_groups(nside: int) -> Iterator[Array]:
    count = max(_FEWEST_RINGS, _TASK_SIZE // (4 * nside))
    for start in range(nside - 1, 3 * nside, count):
        yield np.arange(start, min(start + count, 3 * nside))


@functools.lru_cache(maxsize=32)
def ring_blocks(nside: int, bandlimit: int, order: int) -> list[BeltBlock | CapBlock]:
    """Split the rings of HEALPix into blocks, each the work of one task."""
    layout = HealpixRings(nside)
    sizes, phis, starts = layout.n_phi, layout.first_longitudes, layout.starts
    north = healpix_engine(nside, bandlimit, order).limits
    limits = np.concatenate([north, north[-2::-1]])
    blocks: list[BeltBlock | CapBlock] = []
    for rings in _cap_groups(nside, limits):
        place = (sizes[rings].astype(np.uint64), starts[rings].astype(np.uint64))
        blocks.append(CapBlock(rings, *place, phis[rings], limits[rings]))
    for rings in _belt_groups(nside):
        first = int(starts[rings[0]])
        pixels = slice(first, first + 4 * nside * rings.size)
        blocks.append(BeltBlock(rings, 4 * nside, phis[rings], limits[rings], pixels))
    # The caps of small rings last: they are small tasks, and threads finish together.
    return blocks[::-1]
