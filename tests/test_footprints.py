"""Footprints have the areas and edges of the shapes they are named after."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from spinsdw.errors import DataError, ParameterError, ShapeError
from spinsdw.footprints import disc_holes, random_discs, rectangle_mask, wavy_cut
from spinsdw.healpix import pixel_directions
from spinsdw.masks import cap_mask, galactic_cut
from spinsdw.sampling import MW

NSIDE = 32
POINTS = pixel_directions(NSIDE)
# A sharp edge crosses at most some 8 nside pixels a great circle of length.
EDGE = 8 * NSIDE / (12 * NSIDE**2)


@pytest.mark.parametrize(
    ("longitude", "latitude"),
    [((20, 60), (-59, -30)), ((-10, 15), (0, 40)), ((350, 380), (-90, 90)), ((0, 360), (10, 90))],
)
def test_area_of_a_rectangle(longitude, latitude):
    """Area = (east - west) (sin north - sin south)."""
    sides = {"longitude": tuple(np.radians(longitude)), "latitude": tuple(np.radians(latitude))}
    mask = rectangle_mask(*POINTS, **sides)
    area = np.ptp(sides["longitude"]) * np.ptp(np.sin(sides["latitude"]))
    assert set(np.unique(mask)) == {0.0, 1.0}
    assert abs(mask.mean() - area / (4 * np.pi)) < EDGE


def test_rectangles_side_by_side_tile_the_sphere():
    edges = np.linspace(-0.3, 2 * np.pi - 0.3, 8)
    heights = [-np.pi / 2, -0.4, 0.7, np.pi / 2]
    total = sum(
        rectangle_mask(*POINTS, longitude=(west, east), latitude=(south, north))
        for west, east in itertools.pairwise(edges)
        for south, north in itertools.pairwise(heights)
    )
    np.testing.assert_array_equal(total, 1.0)


def test_cut_without_waves_is_the_galactic_cut():
    flat = wavy_cut(*POINTS, latitude=0.35, amplitude=0.0, seed=1)
    np.testing.assert_array_equal(flat, galactic_cut(NSIDE, 0.35))


@pytest.mark.parametrize("seed", [0, 1, 7])
def test_waves_stay_within_their_amplitude_and_differ_by_seed_and_hemisphere(seed):
    mean, amplitude = 0.35, 0.1
    cut = wavy_cut(*POINTS, latitude=mean, amplitude=amplitude, seed=seed)
    height = np.abs(np.pi / 2 - POINTS[0])
    assert np.all(cut[height > mean + amplitude] == 1)
    assert np.all(cut[height < mean - amplitude] == 0)
    between = cut[np.abs(height - mean) < amplitude]
    assert 0.2 < between.mean() < 0.8
    other = wavy_cut(*POINTS, latitude=mean, amplitude=amplitude, seed=seed + 1)
    assert np.any(other != cut)
    south = wavy_cut(np.pi - POINTS[0], POINTS[1], latitude=mean, amplitude=amplitude, seed=seed)
    assert np.any(south != cut)


def test_a_hole_is_the_complement_of_a_cap():
    centre, radius = (0.9, 6.2), 0.3
    hole = disc_holes(*POINTS, [centre], radius)
    np.testing.assert_array_equal(hole, 1 - cap_mask(*POINTS, centre=centre, radius=radius))


def test_holes_multiply_and_none_hides_nothing():
    centres, radii = random_discs(5, (0.1, 0.3), seed=4)
    product = np.prod([disc_holes(*POINTS, [c], r) for c, r in zip(centres, radii, strict=True)], 0)
    np.testing.assert_array_equal(disc_holes(*POINTS, centres, radii), product)
    np.testing.assert_array_equal(disc_holes(*POINTS, np.empty((0, 2)), 1.0), 1.0)


def test_footprints_take_the_points_of_a_grid():
    """Broadcast points give what the same points give one by one."""
    grid = MW(9)
    theta, phi = np.meshgrid(grid.colatitudes, grid.longitudes, indexing="ij")
    discs = random_discs(3, (0.2, 0.5), seed=2)
    short = grid.colatitudes[:, None], grid.longitudes
    for shape in (
        lambda *at: disc_holes(*at, *discs),
        lambda *at: wavy_cut(*at, latitude=0.3, amplitude=0.1, seed=1),
        lambda *at: rectangle_mask(*at, longitude=(0, 1), latitude=(0, 1)),
    ):
        found = shape(*short)
        assert found.shape == grid.shape
        np.testing.assert_array_equal(found, shape(theta, phi))


def test_random_discs_are_uniform_and_grow_by_appending():
    centres, radii = random_discs(4000, (0.1, 0.2), seed=3)
    few = random_discs(10, (0.1, 0.2), seed=3)
    np.testing.assert_array_equal(centres[:10], few[0])
    np.testing.assert_array_equal(radii[:10], few[1])
    # Means of 4000 uniform numbers: five standard errors.
    assert abs(np.cos(centres[:, 0]).mean()) < 5 * np.sqrt(1 / 3 / 4000)
    assert abs(centres[:, 1].mean() - np.pi) < 5 * 2 * np.pi * np.sqrt(1 / 12 / 4000)
    assert abs(radii.mean() - 0.15) < 5 * 0.1 * np.sqrt(1 / 12 / 4000)


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (
            lambda: rectangle_mask(0, 0, longitude=(1, 1), latitude=(0, 1)),
            ParameterError,
            "longitude",
        ),
        (
            lambda: rectangle_mask(0, 0, longitude=(0, 7), latitude=(0, 1)),
            ParameterError,
            "longitude",
        ),
        (
            lambda: rectangle_mask(0, 0, longitude=(0, 1), latitude=(1, 0)),
            ParameterError,
            "latitude",
        ),
        (lambda: wavy_cut(0, 0, latitude=0.1, amplitude=0.2, seed=1), ParameterError, "amplitude"),
        (lambda: wavy_cut(0, 0, latitude=1.5, amplitude=0.1, seed=1), ParameterError, "amplitude"),
        (lambda: wavy_cut(0, 0, latitude=0.3, amplitude=0.1, seed=-1), ParameterError, "seed"),
        (lambda: random_discs(-1, (0.1, 0.2), seed=1), ParameterError, "count"),
        (lambda: random_discs(1, (0.2, 0.1), seed=1), ParameterError, "radii"),
        (lambda: random_discs(1, (0.0, 0.1), seed=1), ParameterError, "radii"),
        (lambda: disc_holes(0, 0, [0.1, 0.2], 0.1), ShapeError, "centres"),
        (lambda: disc_holes(0, 0, [[0.1, np.nan]], 0.1), DataError, "centres"),
        (lambda: disc_holes(0, 0, [[0.1, 0.1]], 4.0), DataError, "radii"),
    ],
)
def test_bad_input_is_named(call, error, says):
    with pytest.raises(error, match=says):
        call()
