"""The simulated skies: E alone, B alone, all together, and noise, with the true bands of B."""

from __future__ import annotations

import functools
import os
import tempfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import spinsdw
from benchmarks.purity.settings import Setting
from spinsdw.datasets import planck2018_spectra
from spinsdw.harmonics import multiply_by_degree, spin_to_eb
from spinsdw.healpix import flm_to_map, map_to_flm
from spinsdw.simulation import simulate_eb, simulate_qu, white_noise_qu

__all__ = ["KINDS", "MODELS", "Skies", "SkyModel", "band_maps"]

Array = np.ndarray
Spectra = tuple[Array, Array]

KINDS = ("E", "B", "full", "noise")


@dataclass(frozen=True, eq=False)
class SkyModel:
    """Spectra of E and of B of each kind of sky, and the noise.

    Attributes
    ----------
    name, unit : str
        Of the model, and of a leakage of 1.
    spectra : dict of str to (ndarray, ndarray)
        EE and BB of the kinds "E", "B" and "full".
    noise : float
        Of Q and of U, in the map's unit times arcmin.
    """

    name: str
    unit: str
    spectra: dict[str, Spectra] = field(repr=False)
    noise: float


def _cmb() -> SkyModel:
    cl = planck2018_spectra()
    none = np.zeros_like(cl["EE_lensed"])
    r = 0.01
    full = cl["EE_lensed"] + r * cl["EE_tensor"], cl["BB_lensed"] + r * cl["BB_tensor"]
    kinds = {"E": (cl["EE_unlensed"], none), "B": (none, cl["BB_tensor"]), "full": full}
    return SkyModel("cmb", "r", kinds, 2.0)


def _shear() -> SkyModel:
    # Close to the shear of sources near redshift 1: l (l + 1) C_l / 2 pi is 1e-5 at l = 80 and 1e-4
    # at 900. Shape noise of 0.26 in each component and 30 galaxies per square arcmin.
    el = np.arange(2049)
    ee = 8e-8 / (1 + el / 20) ** 1.2
    ee[:2] = 0
    kinds = {"E": (ee, 0 * ee), "B": (0 * ee, 0.01 * ee), "full": (ee, 0.01 * ee)}
    return SkyModel("shear", "B of 1 % of E", kinds, 0.26 / np.sqrt(30))


MODELS: dict[str, Callable[[], SkyModel]] = {"cmb": _cmb, "shear": _shear}


def band_maps(b_lm: Array, setting: Setting) -> Array:
    """Return the fields with the kernels kappa_j of B, shape (..., scales, npix)."""
    tiling = setting.tiling
    rows = [multiply_by_degree(b_lm, tiling.kernel(j)) for j in setting.scales]
    return flm_to_map(np.stack(rows, axis=-2), setting.nside, real=True)


@dataclass(frozen=True)
class Skies:
    """Skies of one model and setting, made when first asked for and kept in a folder.

    Parameters
    ----------
    model : str
        "cmb" or "shear".
    setting : Setting
        Resolution and beam.
    folder : Path, optional
        Where they are kept; a folder of the system's temporary directory when None.
    keep : bool
        False makes every sky anew, for skies that are looked at once.
    """

    model: str
    setting: Setting
    folder: Path | None = None
    keep: bool = True

    @functools.cached_property
    def sky_model(self) -> SkyModel:
        """Spectra and noise."""
        return MODELS[self.model]()

    @functools.cached_property
    def _digest(self) -> str:
        """Tells skies of other spectra, noise or resolution apart in one folder."""
        model, setting = self.sky_model, self.setting
        numbers = [model.noise, setting.nside, setting.bandlimit, setting.beam]
        digest = zlib.crc32(np.array(numbers).tobytes())
        for kind, spectra in model.spectra.items():
            digest = zlib.crc32(kind.encode() + np.array(spectra).tobytes(), digest)
        return f"{digest:08x}"

    def qu(self, kind: str, seed: int) -> tuple[Array, Array]:
        """Return Q and U of one of `KINDS`, or of the B alone of "full": "full B"."""
        q, u = self._kept("qu", kind, seed, lambda: np.array(self._make_qu(kind, seed)))
        return q, u

    def stack(self, kind: str, seeds: list[int]) -> tuple[Array, Array]:
        """Return Q and U of several seeds, shape (seeds, npix)."""
        maps = np.array([self.qu(kind, seed) for seed in seeds])
        return maps[:, 0], maps[:, 1]

    def truth(self, kind: str, seed: int) -> Array:
        """Return the bands of the true full-sky B, shape (scales, npix).

        Of noise: those of the B that best fits the noise of the full sky.
        """
        # Singles: an error of 1e-7 in what methods are compared with.
        make = lambda: band_maps(self._true_b(kind, seed), self.setting).astype(np.float32)  # noqa: E731
        return self._kept("bands", kind, seed, make).astype(np.float64)

    def _eb(self, kind: str, seed: int) -> tuple[Array, Array]:
        spectra = self.sky_model.spectra["full" if kind == "full B" else kind]
        e_lm, b_lm = simulate_eb(
            *spectra, self.setting.bandlimit, seed=seed, beam_fwhm=self.setting.beam
        )
        return (0 * e_lm if kind == "full B" else e_lm), b_lm

    def _make_qu(self, kind: str, seed: int) -> tuple[Array, Array]:
        if kind == "noise":
            return white_noise_qu(self.setting.nside, self.sky_model.noise, seed=seed)
        return simulate_qu(*self._eb(kind, seed), self.setting.nside)

    def _true_b(self, kind: str, seed: int) -> Array:
        if kind != "noise":
            return self._eb(kind, seed)[1]
        q, u = self.qu(kind, seed)
        plm, _ = map_to_flm(q + 1j * u, self.setting.bandlimit, 2)
        return spin_to_eb(plm)[1]

    def _kept(self, what: str, kind: str, seed: int, make: Callable[[], Array]) -> Array:
        if not self.keep:
            return make()
        folder = self.folder or Path(tempfile.gettempdir()) / f"spinsdw-purity-{os.getuid()}"
        name = f"{self.model}-{self._digest}-{spinsdw.__version__}-{kind}-{seed}-{what}.npy"
        path = folder / name
        if not path.is_file():
            folder.mkdir(parents=True, exist_ok=True)
            part = path.with_suffix(f".{os.getpid()}.npy")
            np.save(part, make())
            # At once: another process may be reading.
            part.replace(path)
        return np.load(path)
