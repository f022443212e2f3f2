"""
A gallery of tilings and wavelets
=================================

A wavelet is a tiling, which cuts the degrees into scales, times a directionality, which shapes it
in azimuth. Here is every kind of either that the package has, and how wavelets are steered.
"""

# %%
# Tilings
# -------
# Each shares out the degrees so that the squares of its curves add up to 1. The scaling function,
# dashed, keeps what is below the lowest scale. Scale-discretised tilings and needlets have the
# same support, and the former fall more steeply inside it; splines reach down to degree 1 at every
# scale; a hybrid tiling changes its dilation where it is told to; and any values that pass the
# check are a tiling of one's own, here with three scales of equal width.
import matplotlib.pyplot as plt
import numpy as np

from spinsdw.tiling import (
    CustomTiling,
    HybridTiling,
    NeedletTiling,
    ScaleDiscretisedTiling,
    SplineTiling,
)

bandlimit = 129
degree = np.arange(bandlimit)
centres = np.array([0, 32, 64, 96])[:, None]
hats = np.sqrt(np.maximum(1 - np.abs(degree - centres) / 32, 0))
hats[-1, 96:] = 1.0
tilings = {
    "scale-discretised": ScaleDiscretisedTiling(bandlimit, lowest_scale=2),
    "scale-discretised, dilation 1.5": ScaleDiscretisedTiling(
        bandlimit, dilation=1.5, lowest_scale=5
    ),
    "needlets": NeedletTiling(bandlimit, lowest_scale=2),
    "B-splines": SplineTiling(bandlimit, lowest_scale=2),
    "hybrid: dilation 2, then 1.3": HybridTiling(
        bandlimit, dilations=(2.0, 1.3), transitions=(32,), lowest_scale=2
    ),
    "custom": CustomTiling(hats[0], hats[1:], lowest_scale=1),
}
figure, axes = plt.subplots(3, 2, figsize=(11, 8), layout="constrained")
for panel, (name, tiling) in zip(axes.ravel(), tilings.items(), strict=True):
    tiling.plot(panel)
    panel.set_title(name, pad=14)

# %%
# Directionalities
# ----------------
# ``wavelet_map`` gives a wavelet in pixel space at any place and orientation, as Euler angles:
# longitude and colatitude of its centre, and the angle that it is turned by. With one direction
# it is the same all around; the more directions, the longer its crests. Even numbers make odd
# wavelets, which see edges, and odd numbers even ones, which see lines.
#
# Curvelets have as long crests as their degrees allow. As they were published, their Euler angles
# are not their place but the pole of a circle that they cross, and the last angle says where; a
# centred curvelet lies where it is put. Ridgelets go around the sphere: their place is the pole of
# the great circle that they follow. They see signals alone whose values at opposite points agree.
from spinsdw import (
    CurveletDirectionality,
    RidgeletDirectionality,
    SpinWaveletTransform,
    SteerableDirectionality,
)
from spinsdw.plotting import plot_mollweide
from spinsdw.sampling import MW

fine = MW(120)
here, pole = (0.0, np.pi / 2, 0.0), (0.0, 0.0, np.pi)
kinds = {f"N = {n}": (SteerableDirectionality(n), here) for n in (1, 2, 3, 4, 5, 6)}
kinds |= {
    "curvelet": (CurveletDirectionality(), pole),
    "curvelet, centred": (CurveletDirectionality(centred=True), here),
    "ridgelet": (RidgeletDirectionality(), here),
}
figure, axes = plt.subplots(3, 3, figsize=(13, 9), layout="constrained")
for panel, (name, (directionality, rotation)) in zip(axes.ravel(), kinds.items(), strict=True):
    transform = SpinWaveletTransform(32, directionality=directionality, real=True)
    wavelet = transform.wavelet_map(3, rotation, sampling=fine)
    plot_mollweide(panel, wavelet, title=name, limits=(-wavelet.max(), wavelet.max()))

# %%
# Steering
# --------
# A sequence of orientations: above the wavelet of two directions, below its response to a bright
# disc. It answers where the edge of the disc runs along its crests, and all these responses are
# sums of two of them, ``coefficients[4][0]`` and ``coefficients[4][1]``.
from spinsdw.masks import cap_mask

transform = SpinWaveletTransform(64, directions=2, real=True, multiresolution=False)
grid = transform.sampling
disc = cap_mask(
    grid.colatitudes[:, None], grid.longitudes, centre=(np.radians(75), 0.0), radius=0.7
)
coefficients = transform.analysis(disc)
angles = np.radians([0, 45, 90, 135])
figure, axes = plt.subplots(2, 4, figsize=(16, 5.5), layout="constrained")
for (above, below), angle in zip(axes.T, angles, strict=True):
    wavelet = transform.wavelet_map(3, (0.0, np.pi / 2, angle), sampling=fine)
    limit = wavelet.max()
    plot_mollweide(above, wavelet, title=f"{np.degrees(angle):.0f} degrees", limits=(-limit, limit))
    plot_mollweide(below, coefficients.steer(angle)[4], limits=(-0.15, 0.15))

# %%
# ``strongest_orientation`` finds at every place the angle of the largest response among all, not
# among a few that were tried, and that response: the edge of the disc and its direction.
orientation, strength = coefficients.strongest_orientation(4)
figure, axes = plt.subplots(1, 2, figsize=(11, 3.4), layout="constrained")
plot_mollweide(axes[0], strength, title="strength", limits=(0, strength.max()))
image = plot_mollweide(
    axes[1],
    np.degrees(orientation),
    title="orientation, where it is strong",
    unit="degrees",
    mask=strength > 0.5 * strength.max(),
    limits=(0, 360),
    colour_map="hsv",
)
