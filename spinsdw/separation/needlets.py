"""Spin needlets: coefficients that are spin-2 fields, dropped where their needlets see a hole.

Geller, Hansen, Marinucci, Kerkyacharian & Picard 2008 (arXiv:0811.2881).  The spin needlet of
scale j at a point x is sum_lm kappa_j(l) conj(2Ylm(x)) 2Ylm, so its coefficients are the spin-2
field with the kernel kappa_j, sampled where a quadrature is exact; here on the grids of the
wavelets.  E and B are told apart after the synthesis only: coefficients turn with the frame.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from spinsdw.errors import ParameterError
from spinsdw.harmonics import multiply_by_degree, resize
from spinsdw.separation.energy_share import correlate_with_energy, wavelet_energy
from spinsdw.separation.inputs import check_largest_share
from spinsdw.separation.method import Estimate
from spinsdw.separation.survey import Survey
from spinsdw.spin_transform import SpinHarmonicTransform
from spinsdw.tiling import DilatedTiling, NeedletTiling

__all__ = ["NeedletEstimator", "SpinNeedlets"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class SpinNeedlets:
    """Drop the spin needlet coefficients of the masked map that see too much of the hole.

    Parameters
    ----------
    largest_share : float, default 0.2
        Share of a needlet's energy in the hole, in (0, 1], above which its coefficient is dropped.

    Raises
    ------
    ParameterError
        If the share is out of range.
    """

    name: ClassVar[str] = "needlets"
    largest_share: float = 0.2

    def __post_init__(self) -> None:
        check_largest_share(self.largest_share)

    def prepare(self, survey: Survey) -> NeedletEstimator:
        """Return the estimator for a survey."""
        return NeedletEstimator(survey, float(self.largest_share))


@dataclass(frozen=True, eq=False)
class NeedletEstimator:
    """Spin needlets of the dilation and the scales of a survey's wavelets."""

    survey: Survey
    largest_share: float

    @functools.cached_property
    def tiling(self) -> NeedletTiling:
        """The needlets' kernels: of the same scales and bandlimits as the wavelets'."""
        wavelets = self.survey.transform.tiling
        if not isinstance(wavelets, DilatedTiling):
            msg = f"needlets have one dilation, but the survey's tiling is {wavelets!r}."
            raise ParameterError(msg)
        return NeedletTiling(
            wavelets.bandlimit, dilation=wavelets.dilation, lowest_scale=wavelets.lowest_scale
        )

    @functools.cached_property
    def _kernels(self) -> dict[int | str, Array]:
        tiling = self.tiling
        kernels = {"scaling": tiling.scaling_kernel[: tiling.scaling_bandlimit]}
        return kernels | {j: tiling.kernel(j)[: tiling.scale_bandlimit(j)] for j in tiling.scales}

    def _fields(self) -> Iterator[tuple[int | str, Array, SpinHarmonicTransform]]:
        """Yield every part that holds spin-2 fields with its kernel and its transform."""
        transform = self.survey.transform
        for key, kernel in self._kernels.items():
            if np.any(kernel[2:]):
                grid, threads = transform.grid_of(kernel.size), transform.threads
                field = SpinHarmonicTransform(kernel.size, 2, sampling=grid, threads=threads)
                yield key, kernel, field

    @functools.cached_property
    def kept(self) -> dict[int | str, Array]:
        """1 where a needlet's share in the hole is small enough, else 0; (rings, phi)."""
        survey = self.survey
        shapes = survey.transform.shapes
        kept = {key: np.ones(shape[-2:]) for key, shape in shapes.items()}
        if survey.mask is None:
            return kept
        holes = 1.0 - survey.mask
        for key, kernel, _ in self._fields():
            # Seen from the pole the needlet has the order -2 alone.
            psi = np.sqrt(2 * np.arange(kernel.size) + 1) * kernel
            psi[:2] = 0
            energy = wavelet_energy(psi[None].astype(np.complex128), (-2,), 2, survey.threads)
            seen = survey.sky.integrals(holes, int(np.sqrt(energy.size)))
            grid, turn = survey.transform.grid_of(kernel.size), np.zeros(1)
            share = correlate_with_energy(seen, energy, grid, turn, threads=survey.threads)[0]
            # A mask that is not band-limited rings a little beyond [0, 1].
            kept[key] = (np.minimum(share, 1.0) <= self.largest_share).astype(np.float64)
        return kept

    @functools.cached_property
    def weights(self) -> dict[int | str, Array]:
        """1 where a needlet coefficient was kept, else 0, at the positions of the wavelets'."""
        shapes = self.survey.transform.shapes
        return {key: np.broadcast_to(self.kept[key], shape) for key, shape in shapes.items()}

    def estimate(self, p: Array) -> Estimate:
        """Separate maps, shape (batch, *map)."""
        survey = self.survey
        plm, fit = survey.sky.polarisation_coefficients(survey.footprint * p)
        total = np.zeros_like(plm)
        for key, kernel, field in self._fields():
            part = multiply_by_degree(resize(plm, kernel.size), kernel)
            if survey.mask is not None:
                part = field.analysis(self.kept[key] * field.synthesis(part))
            total += resize(multiply_by_degree(part, kernel), survey.bandlimit)
        return Estimate(survey.transform.analysis_harmonic(total), fit)
