"""
B modes of a ground-based experiment
====================================

From maps of Q and U to a map of B, a map of its errors and a spectrum with error bars.
The sky is simulated, so that all can be held against the truth: lensing and primordial
gravitational waves with a tensor-to-scalar ratio of 0.05, on 8% of the sky, with holes at sources
and noise that grows towards the edge.
"""

# %%
# The sky, the patch and the noise
# --------------------------------
# A beam of two degrees suits HEALPix maps of nside 64 and degrees l < 129. All angles are in
# radians.
import matplotlib.pyplot as plt
import numpy as np

from spinsdw.datasets import planck2018_spectra
from spinsdw.healpix import flm_to_map, pixel_directions
from spinsdw.simulation import gaussian_beam, simulate_eb, simulate_qu, white_noise_qu

nside, bandlimit, fwhm = 64, 129, np.radians(2)
planck = planck2018_spectra()
model_e = planck["EE_lensed"]
model_b = 0.05 * planck["BB_tensor"] + planck["BB_lensed"]
e_lm, b_lm = simulate_eb(model_e, model_b, bandlimit, seed=1, beam_fwhm=fwhm)

# %%
# The telescope sees a cap of 34 degrees around the south of the sky, without six discs around
# bright sources. It looks longest at the middle: ``inverse_noise`` is one over the variance of Q
# and of U at each pixel. Its unit does not matter, and here its mean is 1 where the sky is seen, so
# that 2 uK arcmin are the noise of a typical pixel.
from spinsdw.footprints import disc_holes
from spinsdw.masks import cap_mask, sky_fraction

centre = (np.radians(145), np.radians(30))
points = pixel_directions(nside)
cap = cap_mask(*points, centre=centre, radius=np.radians(34))
sources = np.radians([[130, 20], [150, 70], [165, 340], [138, 50], [147, 10], [128, 45]])
mask = cap * disc_holes(*points, sources, np.radians(1.5))
seen = mask > 0
inverse_noise = cap_mask(*points, centre=centre, radius=np.radians(50), taper_width=np.radians(50))
inverse_noise /= inverse_noise[seen].mean()


def noise(seed):
    """Draw noise in Q and U; what it is where nothing is seen does not matter."""
    return (
        np.array(white_noise_qu(nside, 2.0, seed=seed))
        * seen
        / np.sqrt(np.where(seen, inverse_noise, 1))
    )


q, u = simulate_qu(e_lm, b_lm, nside) + noise(seed=1)
print(f"{100 * sky_fraction(mask):.1f}% of the sky are seen.")

# %%
# Maps are drawn around the middle of the cap.
from spinsdw.plotting import plot_projection
from spinsdw.projections import Projection

patch = Projection("equal_area", centre=centre, radius=np.radians(38), rows=400)


def draw(fields, unit="µK", limits=None):
    """Draw maps side by side, on one scale if limits are given."""
    size = (3.6 * len(fields), 3.3)
    _, axes = plt.subplots(1, len(fields), figsize=size, layout="constrained", squeeze=False)
    for panel, (title, values) in zip(axes[0], fields.items(), strict=True):
        plot_projection(panel, values, patch, title=title, unit=unit, limits=limits, mask=mask)


draw({"Q": q, "U": u}, limits=(-1.5, 1.5))
draw({"noise of Q and U": np.sqrt(1 / np.where(seen, inverse_noise, 1)) * 2}, unit="µK arcmin")

# %%
# The separation
# --------------
# The hybrid method fits E and B together, and decides for every scale, and for every distance from
# the edge, how much to take from the fit and how much from what it leaves, by separating a few
# random skies behind this very mask. That is done once; each further map takes a second or so.
# The method needs no spectra. The inverse noise weighs the pixels, and the beam is that of the
# skies that will be simulated below.
from spinsdw import EBSeparator

separator = EBSeparator(bandlimit, mask, method="hybrid", inverse_noise=inverse_noise, beam=fwhm)
maps = separator.separate(q, u)
for step, seconds in maps.info.seconds.items():
    print(f"{step:18} {seconds:6.2f} s")
fit = maps.info.convergence[0]
print(f"{fit.iterations} steps of the fit, its gradient fell to {fit.residual:.0e} of the first.")

# %%
# E is easy.
true_e = flm_to_map(e_lm, nside, real=True)
draw({"E, true": true_e, "E, recovered": maps.E}, limits=(-1.5, 1.5))

# %%
# What can be known of B
# ----------------------
# ``maps.weights`` says for every scale j, of degrees around 2**j, which share of the variance of B
# is retained: the squared correlation with the truth, as the random skies have it. Structures as
# large as the cap are lost: there E and B look alike, and no method can tell.
draw({f"retained, scale {j}": maps.weights[j] for j in (3, 4, 5, 6)}, "", (0, 1))
for j in maps.info.scales:
    print(f"scale {j}: {100 * maps.weights[j][seen].mean():3.0f}% retained, mean over the patch")

# %%
# A map of B
# ----------
# So we look at the scales from 4 on. Beside the truth and what the method finds of it is the usual
# harmonic transform of the masked map, where E of the edge and of the holes is seen as B.
plain = EBSeparator(bandlimit, mask, method="masked")
whole = EBSeparator(bandlimit, method="masked")


def fine_b(of_separator, separated):
    """Add up B of scale 4 and finer."""
    bands = of_separator.bands(separated)
    return sum(bands[j][1] for j in separated.info.scales if j >= 4)


true_b = fine_b(whole, whole.separate(*simulate_qu(e_lm, b_lm, nside)))
found_b, plain_b = fine_b(separator, maps), fine_b(plain, plain.separate(q, u))
draw(
    {"B, true": true_b, "B, hybrid": found_b, "B, masked transform": plain_b}, limits=(-0.15, 0.15)
)

# %%
# Both have the same noise. What they make of B is told by the correlation with the truth, over the
# pixels farther than two degrees from all that is masked.
from spinsdw.masks import distance_to_edge

inside = distance_to_edge(mask) > np.radians(2)
for name, values in {"hybrid": found_b, "masked transform": plain_b}.items():
    correlation = np.corrcoef(values[inside], true_b[inside])[0, 1]
    print(f"{name:17} correlation with the true B: {correlation:.2f}")

# %%
# How large are the errors?
# -------------------------
# ``uncertainty`` separates simulated skies behind the same mask, with the same noise, and compares
# with what was put in. We give it the spectra of the model: left to itself it takes the band powers
# found in the maps, and does not know of the large structures that the mask took.
errors = separator.uncertainty(
    maps, noise_level=2 * np.pi / 10800, spectra=(model_e, model_b), draws=8
)
draw({"error of E": errors.E, "error of B": errors.B}, unit="µK")

# %%
# It grows towards the edge, with the noise and with what of B is lost there, and it counts the
# large structures, which are lost everywhere. It has to agree with the error that was made, up to
# the luck of the few large structures of one sky.
error = maps.B - flm_to_map(b_lm, nside, real=True)
print(f"rms error of B: {np.sqrt(np.mean(error[inside] ** 2)):.3f} uK, ", end="")
print(f"expected: {np.sqrt(np.mean(errors.B[inside] ** 2)):.3f} uK")


# %%
# A spectrum of B
# ---------------
# The power of a scale is the mean square of its band of B, weighted by the retained sky.
def powers(separated):
    """Return the power of B of the scales from 3 on, of each map of a stack."""
    bands = separator.bands(separated)
    return np.array([np.sum(w * bands[j][1] ** 2, axis=-1) for j, w in sky_weights.items()])


scales = [j for j in maps.info.scales if j >= 3]
sky_weights = {j: maps.weights[j] ** 2 / np.sum(maps.weights[j] ** 2) for j in scales}

# %%
# It is not the spectrum yet. Noise adds to it, and so does what little E comes through; and some
# of B is lost, at large scales most of it. Simulations say how much: skies with E and noise but
# without B give the *bias*, skies of B alone give the *transfer*, the power found over the power
# that the same B has in that band on the whole sky,
# :math:`\sum_\ell (2\ell+1)\, \kappa_j^4(\ell)\, b_\ell^2\, C_\ell / 4\pi`.
from spinsdw import ScaleDiscretisedTiling

el = np.arange(bandlimit)
beam = gaussian_beam(fwhm, bandlimit)
tiling = ScaleDiscretisedTiling(bandlimit, lowest_scale=separator.lowest_scale)
kernels = np.array([tiling.kernel(j) for j in scales])
windows = (2 * el + 1) * kernels**4 * beam**2 / (4 * np.pi)
model_powers = windows @ model_b[:bandlimit]


def simulate(count, *, with_e, with_b):
    """Separate skies of other seeds, with noise where there is E."""
    skies = []
    for seed in range(100, 100 + count):
        e, b = simulate_eb(model_e, model_b, bandlimit, seed=seed, beam_fwhm=fwhm)
        skies.append(simulate_qu(with_e * e, with_b * b, nside) + with_e * noise(seed))
    return separator.separate(*np.swapaxes(skies, 0, 1))


without_b = simulate(16, with_e=1, with_b=0)
b_alone = simulate(16, with_e=0, with_b=1)
bias = powers(without_b).mean(axis=1)
transfer = powers(b_alone).mean(axis=1) / model_powers

# %%
# The scatter of skies with everything in them is the error bar. The separation is linear, but for
# the last digits of its fit, so that maps of B can be added instead of being separated again.
full = [
    np.sum(w * (one[j][1] + other[j][1]) ** 2, axis=-1)
    for one, other in [(separator.bands(without_b), separator.bands(b_alone))]
    for j, w in sky_weights.items()
]
scatter = np.std(full, axis=1, ddof=1)

# %%
# Band powers are in units of a flat :math:`D_\ell = \ell (\ell + 1)\, C_\ell / 2\pi`.
flat = np.divide(2 * np.pi, el * (el + 1), out=np.zeros(bandlimit), where=el > 1)
to_d = 1 / (transfer * (windows @ flat))
measured, error_bars = (powers(maps) - bias) * to_d, scatter * to_d
model = model_powers / (windows @ flat)
print("scale  transfer  bias over B   measured         model")
table = np.array([scales, transfer, bias * to_d / model, measured, error_bars, model])
for row in table.T:
    print("{:5.0f}  {:8.3f}  {:11.2f}   {:.5f} +- {:.5f}  {:.5f} uK^2".format(*row))

# %%
# The masked transform is shown as it is, with neither bias nor transfer corrected: E and noise are
# most of what it takes for B.
plain_bands = plain.bands(plain.separate(q, u))
plain_powers = np.array([np.mean(plain_bands[j][1][seen] ** 2) for j in scales])
degrees = 2.0 ** np.array(scales)
figure, axes = plt.subplots(figsize=(7, 4.2), layout="constrained")
lines = slice(2, bandlimit)
axes.loglog(
    el[lines], (model_b[:bandlimit] / np.where(el > 1, flat, 1))[lines], color="grey", label="model"
)
axes.loglog(degrees, model, "s", color="grey", mfc="none", label="model, in bands")
axes.errorbar(degrees, measured, error_bars, fmt="o", color="C0", capsize=3, label="hybrid")
axes.loglog(
    degrees, plain_powers / (windows @ flat), "x", color="C3", label="masked transform, as it is"
)
axes.set(
    xlabel="degree $\\ell$",
    ylabel=r"$\ell (\ell + 1)\, C_\ell^{BB} / 2\pi$ (µK²)",
    title="B band powers on 8% of the sky",
)
axes.legend()

# %%
# Where the transfer is small, a small number was divided by a small number, and the point stands on
# the model of the simulations as its error bar does. Scales at which B is retained owe them little.
# Sixteen skies know the bias to a quarter of an error bar; an analysis has hundreds.
