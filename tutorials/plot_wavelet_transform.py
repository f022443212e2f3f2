"""
A directional wavelet transform
===============================

Wavelets cut a map into scales, places and orientations, and put it together again exactly.
This lesson takes one map apart.
"""

# %%
# Scales
# ------
# A tiling shares out the degrees: scale j has those between 2**(j-1) and 2**(j+1), and the
# scaling part, drawn dashed, keeps what lies below. The squares of the curves add up to 1 at
# every degree, which is why nothing gets lost. The last scale ends at the bandlimit.
import matplotlib.pyplot as plt
import numpy as np

from spinsdw import SpinWaveletTransform
from spinsdw.plotting import plot_mollweide, plot_tiling

bandlimit = 129
transform = SpinWaveletTransform(bandlimit, directions=3, lowest_scale=2, real=True)
figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
plot_tiling(axes, transform.tiling)

# %%
# A map
# -----
# A Gaussian field with the spectrum of E in Planck 2018, seen with a beam of three degrees, on
# the grid of McEwen and Wiaux: 129 rings of 257 points, from which a field of degrees l < 129 is
# known exactly. It is real and has spin 0; other spins take complex maps and nothing else.
from spinsdw.datasets import planck2018_spectra
from spinsdw.simulation import simulate_eb

spectrum = planck2018_spectra()["EE_unlensed"]
e_lm, _ = simulate_eb(spectrum, 0 * spectrum, bandlimit, seed=1, beam_fwhm=np.radians(3))
sky = transform.harmonic.synthesis(e_lm)
figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
image = plot_mollweide(axes, sky, title="E", unit="µK")

# %%
# Its coefficients
# ----------------
# One array for every scale: orientation, ring, longitude. A scale has only the rings it needs.
coefficients = transform.analysis(sky)
coefficients

# %%
# For pictures every scale may have the full grid instead: ``multiresolution=False`` computes the
# same coefficients at more places.
#
# With three directions a wavelet looks alike after half a turn, and its three orientations are
# 60 degrees apart. Here is scale 3, structures of about twenty degrees, in each of them. The
# lobes of the first wavelet lie east and west of its centre, so it answers most where the map
# changes along a ring.
drawn = SpinWaveletTransform(
    bandlimit, directions=3, lowest_scale=2, real=True, multiresolution=False
)
dense = drawn.analysis(sky)
figure, axes = plt.subplots(1, 3, figsize=(12, 3), layout="constrained")
for panel, values, angle in zip(axes, dense[3], drawn.orientations, strict=True):
    title = f"scale 3, {np.degrees(angle):.0f} degrees"
    plot_mollweide(panel, values, title=title, unit="µK", limits=(-0.06, 0.06))

# %%
# Steering
# --------
# Those three hold every other orientation: the coefficients at any angle are a weighted sum of
# them. Half a turn gives the first one again.
turned = dense.steer(np.pi)
print(f"Largest difference after half a turn: {np.abs(turned[3] - dense[3][0]).max():.0e} µK")

# %%
# So the angle at which a place answers most strongly is known exactly, and how strongly; here
# where the answer is strong, of either sign.
angle, strength = dense.strongest_orientation(3, modulus=True)
is_strong = strength > np.median(strength)
figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
image = plot_mollweide(
    axes,
    np.degrees(angle),
    title="orientation of scale 3",
    unit="degrees",
    mask=is_strong,
    limits=(0, 180),
    colour_map="hsv",
)

# %%
# And back
# --------
# Synthesis adds everything up again, to the rounding of the machine.
error = np.abs(transform.synthesis(coefficients) - sky).max() / np.abs(sky).max()
print(f"The map comes back with a relative error of {error:.1e}.")

# %%
# What is changed in between is changed by scale, place and orientation. Without the scaling part
# and scales 2 to 4, only what is finer than scale 5 remains:
fine = transform.synthesis(coefficients * {"scaling": 0, 2: 0, 3: 0, 4: 0})
figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
image = plot_mollweide(axes, fine, title="E, scales 5 to 7", unit="µK")
