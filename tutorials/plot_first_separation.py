"""
A first separation of E and B
=============================

A sky of polarisation with a little B, a mask, and the maps of E and B behind it.
We make the sky ourselves, so that we know what should come out.
"""

# %%
# A sky
# -----
# E has the spectrum of Planck 2018, B that of primordial gravitational waves with a
# tensor-to-scalar ratio of 0.1. A beam of two degrees keeps both below the bandlimit: degrees
# l < 129, which suits HEALPix maps of nside 64. All angles are in radians.
import matplotlib.pyplot as plt
import numpy as np

from spinsdw.datasets import planck2018_spectra
from spinsdw.healpix import flm_to_map
from spinsdw.simulation import simulate_eb, simulate_qu

nside, bandlimit, ratio = 64, 129, 0.1
spectra = planck2018_spectra()
e_lm, b_lm = simulate_eb(
    spectra["EE_unlensed"],
    ratio * spectra["BB_tensor"],
    bandlimit,
    seed=1,
    beam_fwhm=np.radians(2),
)
q, u = simulate_qu(e_lm, b_lm, nside)
true_e = flm_to_map(e_lm, nside, real=True)
true_b = flm_to_map(b_lm, nside, real=True)
print(f"E has an rms of {true_e.std():.3f} uK and B one of {true_b.std():.3f} uK.")

# %%
# An instrument sees Q and U, and not behind the Galaxy. A mask is 1 where the sky is observed and
# 0 where it is not; what Q and U hold there does not matter.
from spinsdw.masks import distance_to_edge, galactic_cut
from spinsdw.plotting import plot_mollweide

mask = galactic_cut(nside, np.radians(20))
figure, axes = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
for panel, values, title in zip(axes, (q, u), "QU", strict=True):
    plot_mollweide(panel, values, title=title, unit="µK", mask=mask)

# %%
# The separation
# --------------
# Two lines. The separator works out, for every wavelet at every place and in every orientation,
# which share of its energy lies in the hole, and gives less weight to those with more. A
# coefficient with a share of ``largest_share`` or more is dropped.
from spinsdw import EBSeparator
from spinsdw.separation import Pseudo

separator = EBSeparator(bandlimit, mask, directions=3, method=Pseudo(largest_share=0.2))
maps = separator.separate(q, u)


# %%
# The fine structure of E comes back. What is as large as the cut is missing: no wavelet of that
# size fits beside it.
def draw(fields, limit):
    """Draw maps side by side on one scale, those of the whole sky with nothing hidden."""
    width = 4.5 * len(fields)
    _, axes = plt.subplots(1, len(fields), figsize=(width, 3.2), layout="constrained")
    for panel, (title, values) in zip(axes, fields.items(), strict=True):
        hidden = None if "true" in title else mask
        limits = (-limit, limit)
        plot_mollweide(panel, values, title=title, unit="µK", limits=limits, mask=hidden)


draw({"E, true": true_e, "E, recovered": maps.E}, limit=0.6)

# %%
# B, and what happens without wavelets
# ------------------------------------
# B is the hard part: E is several times larger, and a mask turns some of it into B. The usual
# harmonic transform of the masked map shows how much, most of all along the edge.
from spinsdw.healpix import qu_to_eb_flm

_, plain_lm, _ = qu_to_eb_flm(mask * q, mask * u, bandlimit)
plain_b = flm_to_map(plain_lm, nside, real=True)
draw({"B, true": true_b, "B, wavelets": maps.B, "B, plain transform": plain_b}, limit=0.15)

# %%
# How far from the edge to trust what
# -----------------------------------
# ``maps.weights`` holds a map for every scale: the mean weight of the wavelets of scale j, of
# degrees around 2**j, that are centred there. Near 1, the coefficient is that of the whole sky;
# at 0 it was dropped and the map lacks that scale.
figure, axes = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
for panel, j in zip(axes, (3, 6), strict=True):
    plot_mollweide(panel, maps.weights[j], title=f"weight of scale {j}", limits=(0, 1), mask=mask)

# %%
# Scale by scale
# --------------
# ``bands`` gives the maps of each scale alone, which add up to E and B. We put them beside those
# of the whole sky.
whole = EBSeparator(bandlimit)
bands, true_bands = separator.bands(maps), whole.bands(whole.separate(q, u))
figure, axes = plt.subplots(3, 2, figsize=(9, 9), layout="constrained")
for row, j in zip(axes, (3, 4, 5), strict=True):
    style = {"unit": "µK", "limits": (-0.08, 0.08), "mask": mask}
    plot_mollweide(row[0], true_bands[j][1], title=f"B of scale {j}, true", **style)
    plot_mollweide(row[1], bands[j][1], title=f"B of scale {j}, recovered", **style)

# %%
# How much of it is leakage? A sky without B tells: whatever comes out as B is E in disguise. We
# look at the pixels at least three degrees from the edge.
inside = distance_to_edge(mask) > np.radians(3)
leaked = separator.bands(separator.separate(*simulate_qu(e_lm, 0 * b_lm, nside)))
print("scale  true B  leaked  correlation of recovered and true B")
for j in maps.info.scales:
    true, found = true_bands[j][1][inside], bands[j][1][inside]
    correlation = np.corrcoef(true, found)[0, 1]
    print(f"{j:5}  {true.std():6.4f}  {leaked[j][1][inside].std():6.4f}  {correlation:.2f}")

# %%
# At scale 4 and beyond B is B. The coarse scales are what the mask takes; no weighting brings
# them back. A more faithful method has to model E behind the mask: the lesson on a ground-based
# experiment uses one.
