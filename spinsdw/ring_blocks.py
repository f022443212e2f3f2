"""`RingBlock`: a few rings of a HEALPix map between their Fourier columns and their pixels."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, NamedTuple

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


class _Run(NamedTuple):
    """Some rings of one number of points, as arrays (maps, rings, modes or points)."""

    mode_shape: tuple[int, int, int]
    mode_offset: int
    shape: tuple[int, int, int]
    offset: int
    strides: tuple[int, int, int]

    def views(self, modes: Array, pixels: Array) -> tuple[Array, Array]:
        """Return the run's parts of all modes and of all pixels; caps hold thousands of runs."""
        return (
            np.ndarray(self.mode_shape, modes.dtype, modes, self.mode_offset),
            np.ndarray(self.shape, pixels.dtype, pixels, self.offset, self.strides),
        )


class _Layout(NamedTuple):
    """Where the modes of a block lie: those of ring r of map i begin at ``starts[i, r]``."""

    size: int
    starts: Array
    runs: tuple[_Run, ...]


@dataclass(frozen=True, eq=False)
class RingBlock:
    """Some rings between their Fourier columns and their pixels.

    A run is (rings, points, first pixel, pixels from ring to ring): neighbours in the belt, and in
    the caps a ring and its mirror image.
    """

    rings: Array
    sizes: Array
    phis: Array
    limits: Array
    total: int
    runs: tuple[tuple[int, int, int, int], ...]

    @functools.lru_cache(maxsize=4)  # noqa: B019 - blocks are few and shared
    def _layout(self, maps: int, is_real: bool) -> _Layout:
        starts, runs, place = [], [], 0
        size = 8 if is_real else 16
        for count, points, first, step in self.runs:
            modes = points // 2 + 1 if is_real else points
            starts.append(place + np.arange(maps * count).reshape(maps, count) * modes)
            shapes = (maps, count, modes), 16 * place, (maps, count, points)
            runs.append(_Run(*shapes, size * first, (size * self.total, size * step, size)))
            place += maps * count * modes
        return _Layout(place, np.concatenate(starts, axis=1), tuple(runs))

    def fill_pixels(self, columns: Array, pixels: Array) -> None:
        """Fill these rings of maps (maps, all pixels) from columns (maps, m, all rings)."""
        from spinsdw.compiled.folding import fill_folded

        is_real = pixels.dtype == np.float64
        layout = self._layout(len(pixels), is_real)
        modes = np.empty(layout.size, dtype=np.complex128)
        geometry = (self.rings, self.sizes, self.phis, self.limits, layout.starts)
        fill_folded(columns, *geometry, is_real, modes)
        for run in layout.runs:
            from_series(*run.views(modes, pixels))

    def fill_columns(self, pixels: Array, columns: Array) -> None:
        """Fill these rings of the columns from those of the maps: the adjoint."""
        from spinsdw.compiled.folding import fill_unfolded

        is_real = pixels.dtype == np.float64
        layout = self._layout(len(pixels), is_real)
        modes = np.empty(layout.size, dtype=np.complex128)
        for run in layout.runs:
            series, values = run.views(modes, pixels)
            to_series(values, series)
        geometry = (self.rings, self.sizes, self.phis, self.limits, layout.starts)
        fill_unfolded(modes, *geometry, is_real, columns)


def _groups(nside: int) -> list[tuple[list[int], list[tuple[int, int]]]]:
    """Split the rings into blocks: (rings, runs of them as (first place, rings))."""
    last = 4 * nside - 2
    groups: list[tuple[list[int], list[tuple[int, int]]]] = []
    rings: list[int] = []
    for first in range(nside - 1):
        rings += [first, last - first]
        if 4 * (first + 1) * len(rings) >= _TASK_SIZE or first == nside - 2:
            groups.append((rings, [(k, 2) for k in range(0, len(rings), 2)]))
            rings = []
    count = max(_FEWEST_RINGS, _TASK_SIZE // (4 * nside))
    for start in range(nside - 1, 3 * nside, count):
        rings = list(range(start, min(start + count, 3 * nside)))
        groups.append((rings, [(0, len(rings))]))
    # The large ones first, so that threads finish together.
    return groups[::-1]


@functools.lru_cache(maxsize=32)
def ring_blocks(nside: int, bandlimit: int, order: int) -> list[RingBlock]:
    """Split the rings of HEALPix into blocks, each the work of one task."""
    layout = HealpixRings(nside)
    sizes, phis, starts = layout.n_phi, layout.first_longitudes, layout.starts
    north = mirror_engine(nside, bandlimit, order).limits
    limits = np.concatenate([north, north[-2::-1]])
    blocks = []
    for rings, places in _groups(nside):
        runs = []
        for place, count in places:
            first, second = rings[place], rings[place + min(count, 2) - 1]
            step = int(starts[second] - starts[first])
            runs.append((count, int(sizes[first]), int(starts[first]), step))
        geometry = (np.array(rings), sizes[rings], phis[rings], limits[rings])
        blocks.append(RingBlock(*geometry, layout.n_pixels, tuple(runs)))
    return blocks
