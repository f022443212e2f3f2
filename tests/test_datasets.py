"""The bundled files are the ones the README describes."""

from __future__ import annotations

import hashlib
import re

import numpy as np
import pytest

from spinsdw.datasets import planck2018_spectra, wmap_mask_path, wmap_synchrotron_paths
from spinsdw.maps_io import read_mask, read_polarisation

FOLDER = wmap_mask_path().parent


@pytest.fixture(scope="module")
def synchrotron():
    paths = wmap_synchrotron_paths()
    return read_polarisation(paths, columns="BESTFIT", unit="mK_RJ", polconv="COSMO")


def test_readme_lists_every_file_with_its_size_and_digest():
    rows = re.findall(r"^\| `(\S+)` \|.*\| ([\d ]+) \| `(\w+)` \|$", text_of_readme(), re.MULTILINE)
    assert {name for name, _, _ in rows} == {p.name for p in FOLDER.iterdir()} - {"README.md"}
    for name, size, digest in rows:
        data = (FOLDER / name).read_bytes()
        assert len(data) == int(size.replace(" ", ""))
        assert hashlib.sha256(data).hexdigest().startswith(digest)


def text_of_readme():
    return (FOLDER / "README.md").read_text(encoding="utf-8")


def test_spectra_are_eleven_locked_arrays_of_degrees_0_to_2048():
    spectra = planck2018_spectra()
    assert len(spectra) == 11
    assert all(values.shape == (2049,) for values in spectra.values())
    with pytest.raises(TypeError):
        spectra["EE_lensed"] = np.zeros(2049)
    with pytest.raises(ValueError, match="read-only"):
        spectra["EE_lensed"][2] = 0


@pytest.mark.parametrize("kind", ["lensed", "unlensed", "tensor"])
def test_spectra_are_those_of_real_fields(kind):
    """C^TT >= 0, C^EE >= 0, (C^TE)^2 <= C^TT C^EE, no monopole and no dipole"""
    spectra = planck2018_spectra()
    tt, ee, te = (spectra[f"{name}_{kind}"] for name in ("TT", "EE", "TE"))
    assert np.all(tt[2:] > 0)
    assert np.all(ee[2:] > 0)
    assert np.all(te**2 <= tt * ee)
    assert not np.any([tt[:2], ee[:2], te[:2]])


def test_spectra_are_c_l_in_square_microkelvin():
    """D_l = l (l + 1) C_l / 2 pi peaks at 5700 uK^2 near l = 220; lensing B is white, 1.9e-6"""
    spectra = planck2018_spectra()
    degrees = np.arange(2049)
    power = degrees * (degrees + 1) * spectra["TT_lensed"] / (2 * np.pi)
    assert np.argmax(power) == 220
    assert 5600 < power.max() < 5800
    assert 1.8e-6 < spectra["BB_lensed"][10] < 2.0e-6


def test_tensor_power_is_for_a_ratio_of_one():
    """At r = 1 the tensors have about half the scalar temperature power at the lowest degrees."""
    spectra = planck2018_spectra()
    ratio = spectra["TT_tensor"][2:10] / spectra["TT_unlensed"][2:10]
    assert np.all((ratio > 0.3) & (ratio < 0.6))


def test_synchrotron_maps_are_read_in_ring_order(synchrotron):
    """The brightest pixels lie in the galactic plane."""
    healpy = pytest.importorskip("healpy")
    brightest = np.argsort(np.hypot(synchrotron.q, synchrotron.u))[-2000:]
    latitudes = 90 - np.degrees(healpy.pix2ang(64, brightest)[0])
    assert synchrotron.nside == 64
    assert np.mean(np.abs(latitudes)) < 6


def test_synchrotron_power_shows_the_cosmo_convention(synchrotron):
    """E/B power is about 7 with this sign of U and about 2 with the other"""
    healpy = pytest.importorskip("healpy")
    degrees = np.arange(31)
    weights = (2 * degrees + 1) * (degrees >= 2)

    def ratio(u):
        e, b = healpy.map2alm_spin([synchrotron.q, u], 2, lmax=30)
        return weights @ healpy.alm2cl(e) / (weights @ healpy.alm2cl(b))

    assert ratio(synchrotron.u) > 6
    assert ratio(-synchrotron.u) < 3


def test_mask_hides_the_plane_and_holds_zeros_and_ones():
    healpy = pytest.importorskip("healpy")
    mask = read_mask(wmap_mask_path())
    latitudes = 90 - np.degrees(healpy.pix2ang(32, np.arange(mask.size))[0])
    assert set(np.unique(mask)) == {0.0, 1.0}
    assert mask[np.abs(latitudes) < 3].mean() < 0.1
    assert mask[np.abs(latitudes) > 45].mean() > 0.75
