"""
Noise, and how much of it there is
==================================

The variance of wavelet coefficients follows from a power spectrum. So noise of known spectrum can
be told from signal scale by scale, and shrunk.
"""

# %%
# What theory expects
# -------------------
# A Gaussian field of spin 2 with the E spectrum of Planck 2018. All coefficients of a scale have
# one variance, which a map estimates by their mean power.
import matplotlib.pyplot as plt
import numpy as np

from spinsdw import SpinWaveletTransform
from spinsdw.datasets import planck2018_spectra
from spinsdw.harmonics import eb_to_spin
from spinsdw.simulation import simulate_eb
from spinsdw.statistics import scale_spectra, wavelet_variance

bandlimit = 129
transform = SpinWaveletTransform(bandlimit, spin=2, directions=3, lowest_scale=1)
spectrum = planck2018_spectra()["EE_lensed"]
p_lm = eb_to_spin(*simulate_eb(spectrum, 0 * spectrum, bandlimit, seed=1))
measured = scale_spectra(transform, transform.analysis_harmonic(p_lm))
expected = wavelet_variance(transform.wavelets, spectrum)
for j in transform.scales:
    print(f"scale {j}: {measured[j].mean():.2e} measured, {expected[j]:.2e} expected")

# %%
# A noisy map
# -----------
# The synchrotron emission that WMAP saw at 23 GHz, with white noise of a tenth of its power.
from spinsdw.datasets import wmap_synchrotron_paths
from spinsdw.healpix import map_to_flm
from spinsdw.maps_io import read_polarisation
from spinsdw.simulation import gaussian_flm

stated = {"unit": "mK_RJ", "polconv": "COSMO"}
maps = read_polarisation(wmap_synchrotron_paths(), columns="BESTFIT", **stated)
signal, _ = map_to_flm(maps.q + 1j * maps.u, bandlimit, 2)
power = np.sum(np.abs(signal) ** 2)
noise_spectrum = np.full(bandlimit, 0.1 * power / (bandlimit**2 - 4))
noise = eb_to_spin(*(gaussian_flm(noise_spectrum / 2, bandlimit, seed=seed) for seed in (1, 2)))
noise[:4] = 0
noisy = signal + noise


def decibels(found):
    """Return the ratio of power to squared error in decibels."""
    return 10 * np.log10(power / np.sum(np.abs(found - signal) ** 2))


# %%
# Two rules
# ---------
# The usual rule drops what is below three standard deviations of the noise. `denoise` shrinks all
# orientations of a place together, and finds for each scale how much. It needs nothing but the
# spectrum of the noise.
from spinsdw.statistics import denoise

coefficients = transform.analysis_harmonic(noisy)
variances = wavelet_variance(transform.wavelets, noise_spectrum)
dropped = coefficients.threshold({j: 3 * np.sqrt(variances[j]) for j in transform.scales})
shrunk = denoise(transform, coefficients, noise_spectrum)
estimates = [transform.synthesis_harmonic(one) for one in (dropped, shrunk)]
print(f"noisy: {decibels(noisy):.1f} dB")
for name, found in zip(("dropped below 3 sigma", "shrunk together"), estimates, strict=True):
    print(f"{name}: {decibels(found):.1f} dB")

# %%
# Stokes Q of the three, and of the signal, where the noise can be seen.
from spinsdw.plotting import plot_mollweide

titles = ("signal", "signal and noise", "dropped below 3 sigma", "shrunk together")
figure, axes = plt.subplots(2, 2, figsize=(10, 6), layout="constrained")
for panel, title, flm in zip(axes.flat, titles, (signal, noisy, *estimates), strict=True):
    q = transform.harmonic.synthesis(flm).real
    plot_mollweide(panel, q, title=title, unit="mK", limits=(-0.05, 0.05))

# %%
# A closer look
# -------------
# At a patch of 40 degrees, in the plane of projection, from samples four times as fine. Around a
# centre the frame of a field with spin is carried along great circles, so that Q means the same
# all over the picture.
from spinsdw import SpinHarmonicTransform
from spinsdw.harmonics import resize
from spinsdw.projections import Projection, project_map

patch = Projection("gnomonic", centre=(np.radians(70), np.radians(30)), radius=np.radians(20))
fine = SpinHarmonicTransform(4 * bandlimit, 2)
figure, axes = plt.subplots(1, 3, figsize=(11, 4), layout="constrained")
shown = zip(axes, ("signal", "signal and noise", "shrunk together"), strict=True)
for (panel, title), flm in zip(shown, (signal, noisy, estimates[1]), strict=True):
    picture = project_map(fine.synthesis(resize(flm, fine.bandlimit)), patch, spin=2)
    image = panel.imshow(picture.real, cmap="RdBu_r", vmin=-0.2, vmax=0.2)
    panel.set_title(title)
    panel.set_axis_off()
bar = figure.colorbar(image, ax=axes, label="Q (mK)", shrink=0.8)
