"""Flat pictures: where their points lie, and how fields with spin are turned."""

from __future__ import annotations

import numpy as np
import pytest

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.harmonics import resize
from spinsdw.healpix import pixel_directions
from spinsdw.projections import Projection, project_map
from spinsdw.rotation import rotate_flm
from spinsdw.sampling import MW, resolve_sampling
from spinsdw.spin_transform import SpinHarmonicTransform
from tests.helpers import needs_compiler, random_flm

WHOLE = ("mollweide", "sinusoidal", "mercator")
AROUND = {
    "orthographic": np.sin,
    "stereographic": lambda a: 2 * np.tan(a / 2),
    "gnomonic": np.tan,
    "equal_area": lambda a: 2 * np.sin(a / 2),
}
CENTRES = [(np.pi / 2, 0.0), (0.0, 0.0), (np.pi, 1.0), (0.7, 2.5), (2.9, -1.0)]


def vectors(colatitudes, longitudes):
    sines = np.sin(colatitudes)
    return np.stack(
        [sines * np.cos(longitudes), sines * np.sin(longitudes), np.cos(colatitudes)], axis=-1
    )


def plane(projection):
    """Return x, to the right, and y, up, of every point."""
    (width, height), (rows, columns) = projection.half_size, projection.raster.colatitudes.shape
    y = height * (1 - (2 * np.arange(rows) + 1) / rows)
    x = width * ((2 * np.arange(columns) + 1) / columns - 1)
    return np.meshgrid(x, y)


@pytest.mark.parametrize("name", AROUND)
@pytest.mark.parametrize("centre", CENTRES)
def test_distance_from_the_centre_is_that_of_the_projection(name, centre):
    """hypot(x, y) = rho(a) with cos a = p . c."""
    projection = Projection(name, centre=centre, rows=40)
    raster = projection.raster
    inside = np.isfinite(raster.colatitudes)
    x, y = plane(projection)
    away = vectors(raster.colatitudes, raster.longitudes)[inside] - vectors(*centre)
    angle = 2 * np.arcsin(np.clip(np.linalg.norm(away, axis=-1) / 2, 0, 1))
    np.testing.assert_allclose(AROUND[name](angle), np.hypot(x, y)[inside], rtol=1e-9)
    assert inside.mean() == pytest.approx(np.pi / 4, abs=0.03)


@pytest.mark.parametrize("name", AROUND)
@pytest.mark.parametrize("centre", CENTRES)
def test_up_is_north_and_left_is_east(name, centre):
    """The direction of a point from the centre, in the centre's own frame."""
    projection = Projection(name, centre=centre, rows=20)
    raster = projection.raster
    inside = np.isfinite(raster.colatitudes)
    x, y = plane(projection)
    step = 1e-6
    north = vectors(centre[0] - step, centre[1]) - vectors(centre[0] + step, centre[1])
    east = np.array([-np.sin(centre[1]), np.cos(centre[1]), 0.0])
    points = vectors(raster.colatitudes, raster.longitudes)[inside]
    length = np.hypot(points @ (north / (2 * step)), points @ east)
    radius = np.hypot(x, y)[inside]
    np.testing.assert_allclose(
        points @ (north / (2 * step)) / length, y[inside] / radius, atol=1e-6
    )
    np.testing.assert_allclose(points @ east / length, -x[inside] / radius, atol=1e-6)


def test_whole_sky_pictures_follow_their_formulas():
    """sinusoidal: x = -phi cos b, y = b; mercator: x = -phi, y = log tan(pi/4 + b/2)."""
    for name in WHOLE:
        projection = Projection(name, centre=(np.pi / 2, 0.5), rows=60)
        raster = projection.raster
        inside = np.isfinite(raster.colatitudes)
        latitude = np.pi / 2 - raster.colatitudes[inside]
        east = (raster.longitudes[inside] - 0.5 + np.pi) % (2 * np.pi) - np.pi
        x, y = (part[inside] for part in plane(projection))
        if name == "sinusoidal":
            found = -east * np.cos(latitude), latitude
        elif name == "mercator":
            found = -east, np.log(np.tan(np.pi / 4 + latitude / 2))
        else:
            # 2 t + sin 2 t = pi sin b, and y = sin t.
            t = np.arcsin(y)
            np.testing.assert_allclose(2 * t + np.sin(2 * t), np.pi * np.sin(latitude), atol=1e-12)
            found = -2 * east / np.pi * np.cos(t), np.sin(t)
        np.testing.assert_allclose(found, (x, y), rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["mollweide", "sinusoidal", "equal_area"])
def test_equal_area_projections_show_each_part_of_the_sky_as_large_as_it_is(name):
    """Of the points of the picture a share (1 - cos a) / 2 lies within a of any direction."""
    raster = Projection(name, rows=400).raster
    inside = np.isfinite(raster.colatitudes)
    points = vectors(raster.colatitudes, raster.longitudes)[inside]
    for direction in ((0.3, 1.0), (1.6, 0.2), (2.2, 4.0)):
        share = np.mean(points @ vectors(*direction) > np.cos(0.6))
        assert share == pytest.approx((1 - np.cos(0.6)) / 2, rel=0.02)


@needs_compiler
@pytest.mark.parametrize("spin", [0, 1, 2, -3])
@pytest.mark.parametrize("name", AROUND)
def test_rotated_fields_look_alike_from_the_rotated_centre(name, spin):
    """The picture of f around c is that of R f around R c: the frame is the picture's own.

    Nearest samples are off by half a step of the grid times the slope of the field.
    """
    bandlimit, fine = 5, 180
    flm = random_flm(bandlimit, spin)
    alpha, beta = 0.8, 1.1
    transform = SpinHarmonicTransform(fine, spin)
    maps = [
        transform.synthesis(resize(one, fine)) for one in (flm, rotate_flm(flm, (alpha, beta, 0.0)))
    ]
    centres = (np.pi / 2, 0.0), (np.pi / 2 + beta, alpha)
    radius = 1.2
    one, other = (
        project_map(values, Projection(name, centre=centre, radius=radius, rows=31), spin=spin)
        for values, centre in zip(maps, centres, strict=True)
    )
    inside = np.isfinite(one)
    assert np.array_equal(inside, np.isfinite(other))
    scale = np.abs(one[inside]).max()
    assert np.abs(one - other)[inside].max() < 2 * bandlimit * np.pi / fine * scale


def test_healpix_maps_and_other_grids_are_projected():
    projection = Projection("gnomonic", centre=(0.9, 1.0), radius=0.3, rows=9)
    raster = projection.raster
    inside = np.isfinite(raster.colatitudes)
    colatitudes, _ = pixel_directions(64)
    picture = project_map(colatitudes, projection)
    assert np.abs(picture - raster.colatitudes)[inside].max() < 0.02
    sampling = resolve_sampling("gl", 100)
    values = np.repeat(sampling.colatitudes[:, None], sampling.n_phi, axis=1)
    picture = project_map(values, projection, sampling=sampling)
    assert np.abs(picture - raster.colatitudes)[inside].max() < 0.02


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"name": "globe"}, "name='globe' must be a projection, one of"),
        ({"centre": (0.3, 0.0)}, "must lie on the equator for mollweide; rotate the map"),
        ({"centre": (4.0, 0.0)}, "must be a colatitude from 0 to pi and a longitude"),
        ({"centre": 1.0}, "must be a colatitude from 0 to pi"),
        ({"name": "gnomonic", "radius": 1.6}, "radius=1.6 must be above 0 and at most 1.553"),
        ({"name": "gnomonic", "radius": 0}, "radius=0 must be above 0"),
        ({"name": "gnomonic", "radius": "wide"}, "radius='wide' must be"),
        ({"rows": 0}, "rows=0"),
    ],
)
def test_bad_projections_are_refused(arguments, message):
    with pytest.raises(ParameterError, match=message):
        Projection(**arguments)


def test_bad_maps_are_refused():
    projection = Projection("orthographic", rows=4)
    with pytest.raises(DataError, match="a field of spin 2 needs complex numbers"):
        project_map(np.ones(48), projection, spin=2)
    with pytest.raises(ShapeError, match="they must have"):
        project_map(np.ones((3, 3)), projection, sampling=MW(4))
    with pytest.raises(ShapeError, match="it must be HEALPix"):
        project_map(np.ones((3, 9)), projection)
    with pytest.raises(ParameterError, match="spin="):
        project_map(np.ones(48), projection, spin=0.5)
