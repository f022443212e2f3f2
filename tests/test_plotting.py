"""Pictures show each direction of the sky in its place, and nothing that is hidden."""

from __future__ import annotations

import os
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest

from spinsdw.errors import (
    DataError,
    MissingPackageError,
    OutputExistsError,
    ParameterError,
    ShapeError,
)
from spinsdw.healpix import UNSEEN
from spinsdw.maps_io import HealpixMap
from spinsdw.plotting import (
    HIDDEN_COLOUR,
    figure_grid,
    mollweide_figure,
    plot_mollweide,
    plot_projection,
    plot_tiling,
    save_figure,
)
from spinsdw.projections import Projection
from spinsdw.sampling import MW, MWSS
from spinsdw.tiling import ScaleDiscretisedTiling
from tests.helpers import assert_close

matplotlib = pytest.importorskip("matplotlib")
healpy = pytest.importorskip("healpy")

NPIX = 192
RNG = np.random.default_rng(5)
SIGNED = RNG.standard_normal(NPIX)


@pytest.fixture
def axes():
    from matplotlib.figure import Figure

    return Figure().subplots()


@pytest.fixture
def raster():
    return Projection(rows=40).raster


def colours_of(figure):
    """Return the red, green and blue bytes of a drawn figure, shape (height, width, 3)."""
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())[..., :3]


# Projection


def test_raster_inverts_the_mollweide_projection(raster):
    """x = -2 (phi / pi) cos t, y = sin t, 2 t + sin 2 t = pi sin(latitude), phi in (-pi, pi]"""
    rows, columns = np.nonzero(np.isfinite(raster.colatitudes))
    latitudes = np.pi / 2 - raster.colatitudes[rows, columns]
    longitudes = raster.longitudes[rows, columns]
    longitudes = np.where(longitudes > np.pi, longitudes - 2 * np.pi, longitudes)
    y = 1 - (2 * rows + 1) / 40
    x = 2 * ((2 * columns + 1) / 80 - 1)
    auxiliary = np.arcsin(y)
    assert_close(np.pi * np.sin(latitudes), 2 * auxiliary + np.sin(2 * auxiliary), ulps=32)
    assert_close(-2 * longitudes / np.pi * np.cos(auxiliary), x, ulps=32)


def test_raster_is_equal_area():
    """Every point of the picture stands for the same solid angle: the mean of z^2 is 1/3."""
    raster = Projection(rows=400).raster
    inside = np.isfinite(raster.colatitudes)
    assert abs(np.mean(np.cos(raster.colatitudes[inside]) ** 2) - 1 / 3) < 1e-3
    assert abs(np.mean(inside) - np.pi / 4) < 1e-3


def test_north_is_up_and_east_is_left(raster):
    assert raster.colatitudes[2, 40] < np.pi / 4
    assert raster.colatitudes[-3, 40] > 3 * np.pi / 4
    assert 0 < raster.longitudes[20, 10] < np.pi
    assert np.pi < raster.longitudes[20, 70] < 2 * np.pi


def test_healpix_picture_has_the_pixel_of_each_direction(raster):
    inside = np.isfinite(raster.colatitudes)
    picture = raster.picture(np.arange(float(NPIX)))
    pixels = healpy.ang2pix(4, raster.colatitudes[inside], raster.longitudes[inside])
    np.testing.assert_array_equal(picture[inside], pixels)
    assert np.all(np.isnan(picture[~inside]))


@pytest.mark.parametrize("grid", [MW(1), MW(6), MWSS(1), MWSS(6)], ids=repr)
def test_grid_picture_has_the_sample_nearest_in_each_angle(raster, grid):
    inside = np.isfinite(raster.colatitudes)
    values = np.arange(float(np.prod(grid.shape))).reshape(grid.shape)
    rings = np.abs(raster.colatitudes[inside][:, None] - grid.colatitudes).argmin(axis=1)
    turns = np.exp(1j * (raster.longitudes[inside][:, None] - grid.longitudes))
    expected = values[rings, np.abs(np.angle(turns)).argmin(axis=1)]
    np.testing.assert_array_equal(raster.picture(values)[inside], expected)


# Colours


def test_limits_of_signed_maps_are_symmetric_and_leave_out_extremes(axes):
    values = SIGNED.copy()
    values[7] = 1e6
    image = plot_mollweide(axes, values)
    low, high = image.get_clim()
    assert low == -high
    assert high == np.percentile(np.abs(values), 99.5)
    assert image.get_cmap().name == "RdBu_r"


def test_limits_of_unsigned_maps_are_their_range_without_extremes(axes):
    image = plot_mollweide(axes, SIGNED**2)
    assert image.get_clim() == tuple(np.percentile(SIGNED**2, [0.5, 99.5]))
    assert image.get_cmap().name == "viridis"


@pytest.mark.parametrize("value", [-3.0, 5.0])
def test_lone_values_set_the_limits(axes, value):
    """A map that is zero nearly everywhere has percentiles of zero."""
    sparse = np.zeros(12 * 64**2)
    sparse[[7, 9]] = value, -1.0
    low, high = plot_mollweide(axes, sparse).get_clim()
    assert high == max(abs(value), abs(low)) or (low, high) == (value, 0.0)


def test_constant_map_can_be_drawn():
    assert colours_of(mollweide_figure(np.full(NPIX, 2.0))).size


def test_given_limits_and_colours_are_taken(axes):
    image = plot_mollweide(axes, SIGNED, limits=(-0.5, 0.25), colour_map="magma")
    assert image.get_clim() == (-0.5, 0.25)
    assert image.get_cmap().name == "magma"


@pytest.mark.parametrize("limits", [(1, 1), (2, 1), (0, np.inf), (np.nan, 1)])
def test_limits_must_be_ordered_and_finite(axes, limits):
    with pytest.raises(ParameterError, match="must be two finite numbers, the lower one first"):
        plot_mollweide(axes, SIGNED, limits=limits)


def test_colour_map_must_exist(axes):
    with pytest.raises(ParameterError, match="colour_map='FOO' must be a colour map"):
        plot_mollweide(axes, SIGNED, colour_map="FOO")


# Hidden sky


def test_masked_and_bad_pixels_are_hidden(axes):
    values = SIGNED.copy()
    values[[0, 1, 2]] = UNSEEN, np.nan, -999.0
    mask = np.ones(NPIX)
    mask[3] = 0
    sky = HealpixMap(values, sentinel=-999.0)
    picture = plot_mollweide(axes, sky, mask=mask).get_array()
    shown = set(np.asarray(picture)[~np.ma.getmaskarray(picture)])
    assert shown == set(values[4:])


def test_hidden_sky_is_grey_and_the_corners_are_white():
    theta = healpy.pix2ang(16, np.arange(3072))[0]
    figure = mollweide_figure(np.ones(3072), mask=np.abs(theta - np.pi / 2) > 0.3)
    drawn = colours_of(figure)
    box = figure.axes[0].get_window_extent()
    row = drawn.shape[0] - int(box.y0 + box.height / 2)
    grey = tuple(int(HIDDEN_COLOUR[i : i + 2], 16) for i in (1, 3, 5))
    # A little beside the meridian and the equator, which are drawn.
    assert tuple(drawn[row - 9, int(box.x0 + box.width / 2) + 9]) == grey
    assert tuple(drawn[0, 0]) == (255, 255, 255)
    assert tuple(drawn[drawn.shape[0] - int(box.y1) + 3, int(box.x0) + 3]) == (255, 255, 255)


@pytest.mark.parametrize(
    ("sky", "mask", "error", "message"),
    [
        (SIGNED * 1j, None, DataError, "must be real; plot .real and .imag apart"),
        (np.full(NPIX, np.nan), None, DataError, "all 192 values of the map are hidden"),
        (SIGNED, np.zeros(NPIX), DataError, "all 192 values of the map are hidden"),
        (SIGNED, np.ones(48), ShapeError, r"mask has shape \(48,\) and the map \(192,\)"),
        (np.ones(13), None, ShapeError, "12 nside"),
        (np.ones((4, 4)), None, ShapeError, r"must be HEALPix \(12 nside\*\*2,\), MW"),
        (np.ones((3, 4, 7)), None, ShapeError, r"must be HEALPix \(12 nside\*\*2,\), MW"),
    ],
)
def test_what_cannot_be_drawn_is_refused(axes, sky, mask, error, message):
    with pytest.raises(error, match=message):
        plot_mollweide(axes, sky, mask=mask)


# Figures


def test_map_carries_its_title_and_unit(axes):
    plot_mollweide(axes, HealpixMap(SIGNED, unit="uK"), title="Stokes Q")
    assert axes.get_title() == "Stokes Q"
    assert axes.figure.axes[1].get_xlabel() == "uK"


def test_given_unit_stands_above_that_of_the_map_and_unknown_is_not_shown():
    figure = mollweide_figure(HealpixMap(SIGNED, unit="K"), unit="nK")
    assert figure.axes[1].get_xlabel() == "nK"
    assert mollweide_figure(HealpixMap(SIGNED)).axes[1].get_xlabel() == ""


def test_grid_has_a_panel_and_a_colour_bar_for_every_map():
    figure = figure_grid({name: SIGNED for name in "ABC"}, columns=2, limits=(-1, 1))
    assert [axes.get_title() for axes in figure.axes][:3] == ["A", "B", "C"]
    assert len(figure.axes) == 6


@pytest.mark.parametrize(("maps", "columns"), [({}, 2), ({"A": SIGNED}, 0), ({"A": SIGNED}, 1.5)])
def test_grid_needs_maps_and_columns(maps, columns):
    with pytest.raises(ParameterError, match="must both be at least 1; give some maps"):
        figure_grid(maps, columns=columns)


def test_axes_of_pyplot_can_be_drawn_on():
    from matplotlib import pyplot

    figure, axes = pyplot.subplots()
    plot_mollweide(axes, SIGNED)
    pyplot.close(figure)
    assert len(figure.axes) == 2


def test_figures_need_no_display_and_leave_pyplot_alone(tmp_path):
    """healpy imports pyplot, so that its absence proves nothing; a figure it knows would."""
    code = (
        "import sys, numpy as np; from spinsdw.plotting import *;"
        "save_figure(mollweide_figure(np.arange(48.)), sys.argv[1]);"
        "from matplotlib import pyplot; assert not pyplot.get_fignums()"
    )
    path = tmp_path / "map.png"
    bare = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "MPLBACKEND")}
    subprocess.run([sys.executable, "-c", code, str(path)], check=True, env=bare, timeout=120)
    assert path.read_bytes().startswith(b"\x89PNG")


def test_without_matplotlib_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingPackageError, match=r"pip install 'spinsdw\[plot\]'"):
        mollweide_figure(SIGNED)


# Files


@pytest.mark.parametrize(("suffix", "magic"), [("png", b"\x89PNG"), ("PDF", b"%PDF")])
def test_suffix_says_the_format(tmp_path, suffix, magic):
    path = save_figure(mollweide_figure(SIGNED), tmp_path / f"map.{suffix}")
    assert path.read_bytes().startswith(magic)


def test_figure_is_not_overwritten_unasked_and_the_format_must_be_known(tmp_path):
    figure = mollweide_figure(SIGNED)
    path = save_figure(figure, tmp_path / "map.png")
    with pytest.raises(OutputExistsError, match="exists already; give another name or overwrite"):
        save_figure(figure, path)
    assert save_figure(figure, path, overwrite=True) == path
    with pytest.raises(ParameterError, match=r"must end in one of .*; \.png suits maps"):
        save_figure(figure, tmp_path / "map.fits")
    assert [found.name for found in tmp_path.iterdir()] == ["map.png"]


# Tilings


@pytest.mark.parametrize(
    "tiling",
    [
        ScaleDiscretisedTiling(64),
        ScaleDiscretisedTiling(64, dilation=1.2, lowest_scale=9),
        ScaleDiscretisedTiling(3),
    ],
    ids=repr,
)
def test_tiling_is_drawn_as_its_kernels(axes, tiling):
    plot_tiling(axes, tiling)
    kernels = [tiling.kernel(j) for j in tiling.scales] + [tiling.scaling_kernel]
    kernels = [kernel for kernel in kernels if kernel[1:].any()]
    assert len(axes.lines) == len(kernels)
    for line, kernel in zip(axes.lines, kernels, strict=True):
        degrees, values = line.get_data()
        np.testing.assert_array_equal(values, kernel[degrees])
        assert kernel[1:].sum() == pytest.approx(values.sum())
    axes.figure.canvas.draw()


def test_tilings_draw_themselves(axes):
    """On axes that are given, or on those of a new figure."""
    tiling = ScaleDiscretisedTiling(64)
    assert tiling.plot(axes) is axes
    alone = tiling.plot()
    assert alone.figure is not axes.figure
    for one, other in zip(alone.lines, axes.lines, strict=True):
        np.testing.assert_array_equal(one.get_data(), other.get_data())
    alone.figure.canvas.draw()


def test_labels_of_scales_do_not_overlap(axes):
    tiling = ScaleDiscretisedTiling(256, dilation=1.1, lowest_scale=15)
    plot_tiling(axes, tiling)
    axes.figure.canvas.draw()
    boxes = sorted((text.get_window_extent() for text in axes.texts), key=lambda box: box.x0)
    assert 3 < len(boxes) < len(tiling.scales)
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))


@pytest.mark.parametrize("name", ["orthographic", "gnomonic", "stereographic", "mercator"])
def test_any_projection_is_drawn_with_its_edge_white(name, axes):
    figure = axes.figure
    sky = np.arange(192) - 90.0
    projection = Projection(name, rows=60)
    image = plot_projection(axes, sky, projection, title="sky", unit="K")
    assert image.get_clim()[0] < 0 < image.get_clim()[1]
    assert figure.axes[0].get_title() == "sky"
    assert figure.axes[1].get_xlabel() == "K"
    outside = np.isnan(projection.raster.colatitudes)
    cover = figure.axes[0].images[1].get_array()
    assert np.array_equal(cover[..., 3] == 1, outside)
    assert np.array_equal(np.isnan(np.ma.filled(image.get_array(), np.nan)), outside)


def test_masked_sky_within_a_projection_is_hidden(axes):
    sky = np.ones(48)
    mask = np.arange(48) < 24
    image = plot_projection(axes, sky * np.arange(48), Projection(rows=40), mask=mask)
    shown = np.ma.filled(image.get_array(), np.nan)
    assert np.nanmax(shown) < 24
    assert np.isnan(shown[-5, 40])
