"""`RingBlock`: a few rings of a HEALPix map between their Fourier columns and their pixels."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from spinsdw.fourier import from_series, to_series
from spinsdw.mirror_engine import MirrorEngine
from spinsdw.sampling.healpix_rings import HealpixRings

__all__ = ["RingBlock", "mirror_engine", "ring_blocks", "task_bytes"]

Array = np.ndarray[Any, Any]

# Complex numbers of the rings that one task transforms: they stay in a core's cache.
_TASK_SIZE = 2**14
# Columns are read by rings side by side: fewer would be less than two cache lines.
_FEWEST_RINGS = 8


def task_bytes(nside: int) -> int:
    """Return about how many bytes one task takes for each map."""
    return 16 * max(_TASK_SIZE, 4 * nside * _FEWEST_RINGS)


@functools.lru_cache(maxsize=32)
def mirror_engine(nside: int, bandlimit: int, order: int) -> MirrorEngine:
    """Return the sums of one order on the rings of HEALPix."""
    north = HealpixRings(nside).colatitudes[: 2 * nside]
    return MirrorEngine(bandlimit, north, order)


@dataclass(frozen=True, eq=False)
class RingBlock:
    """Some rings between their Fourier columns and their pixels, mirror images next to each other.

    A run is some neighbours of one number of points: (rings, points, first pixel).
    """

    rings: Array
    sizes: Array
    phis: Array
    limits: Array
    runs: tuple[tuple[int, int, int], ...]

    @functools.lru_cache(maxsize=4)  # noqa: B019 - blocks are few and shared
    def _starts(self, maps: int, real: bool) -> Array:
        """Where the modes of each map's rings begin: runs lie as (maps, rings, modes)."""
        parts, place = [], 0
        for count, points, _ in self.runs:
            modes = points // 2 + 1 if real else points
            parts.append(place + np.arange(maps * count).reshape(maps, count) * modes)
            place += maps * count * modes
        return np.concatenate(parts, axis=1)

    def _room(self, pixels: Array) -> tuple[Array, Array]:
        """Return room for the modes, and where each ring's begin."""
        maps, is_real = len(pixels), not np.iscomplexobj(pixels)
        modes = self.sizes // 2 + 1 if is_real else self.sizes
        room = np.empty(maps * int(modes.sum()), dtype=np.complex128)
        return room, self._starts(maps, is_real)

    def _transform(self, call: Callable[[Array, Array], None], modes: Array, pixels: Array) -> None:
        """Call for every run with (modes, pixels) of shape (maps, rings, modes or points)."""
        maps, place = len(pixels), 0
        for count, points, first in self.runs:
            part = pixels[:, first : first + count * points].reshape(maps, count, points)
            size = points // 2 + 1 if pixels.dtype == np.float64 else points
            stop = place + maps * count * size
            call(modes[place:stop].reshape(maps, count, size), part)
            place = stop

    def fill_pixels(self, columns: Array, pixels: Array) -> None:
        """Fill these rings of maps (maps, all pixels) from columns (maps, m, all rings)."""
        from spinsdw.compiled.folding import fill_folded

        modes, starts = self._room(pixels)
        geometry = (self.rings, self.sizes, self.phis, self.limits, starts)
        fill_folded(columns, *geometry, pixels.dtype == np.float64, modes)
        self._transform(from_series, modes, pixels)

    def fill_columns(self, pixels: Array, columns: Array) -> None:
        """Fill these rings of the columns from those of the maps: the adjoint."""
        from spinsdw.compiled.folding import fill_unfolded

        modes, starts = self._room(pixels)
        self._transform(lambda series, values: to_series(values, series), modes, pixels)
        geometry = (self.rings, self.sizes, self.phis, self.limits, starts)
        fill_unfolded(modes, *geometry, pixels.dtype == np.float64, columns)


def _groups(nside: int) -> list[tuple[list[int], list[tuple[int, int]]]]:
    """Split the rings into blocks: (rings, runs of them as (first ring, rings))."""
    last = 4 * nside - 2
    groups: list[tuple[list[int], list[tuple[int, int]]]] = []
    rings: list[int] = []
    for first in range(nside - 1):
        rings += [first, last - first]
        if 4 * (first + 1) * len(rings) >= _TASK_SIZE or first == nside - 2:
            groups.append((rings, [(r, 1) for r in rings]))
            rings = []
    count = max(_FEWEST_RINGS, _TASK_SIZE // (4 * nside))
    for start in range(nside - 1, 3 * nside, count):
        rings = list(range(start, min(start + count, 3 * nside)))
        groups.append((rings, [(start, len(rings))]))
    # The large ones first, so that threads finish together.
    return groups[::-1]


@functools.lru_cache(maxsize=32)
def ring_blocks(nside: int, bandlimit: int, order: int) -> list[RingBlock]:
    """Split the rings of HEALPix into blocks, each the work of one task."""
    layout = HealpixRings(nside)
    sizes, phis, starts = layout.n_phi, layout.first_longitudes, layout.starts
    north = mirror_engine(nside, bandlimit, order).limits
    limits = np.concatenate([north, north[-2::-1]])
    return [
        RingBlock(
            np.array(rings),
            sizes[rings],
            phis[rings],
            limits[rings],
            tuple((count, int(sizes[r]), int(starts[r])) for r, count in runs),
        )
        for rings, runs in _groups(nside)
    ]
