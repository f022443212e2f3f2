"""Maps come from files as what they are, or not at all; what is written can be read by anyone."""

from __future__ import annotations

import contextlib
import gzip
import re
import tracemalloc
import warnings

import numpy as np
import pytest
from astropy.io import fits
from hypothesis import given
from hypothesis import strategies as st

from spinsdw.datasets import wmap_synchrotron_paths
from spinsdw.errors import (
    DataError,
    FileFormatError,
    MemoryBudgetError,
    OutputExistsError,
    ParameterError,
    ShapeError,
    SpinsdwError,
)
from spinsdw.healpix import UNSEEN, bad_pixel_mask
from spinsdw.maps_io import (
    HealpixMap,
    PolarisationMaps,
    read_map,
    read_mask,
    read_polarisation,
    write_maps,
)

healpy = pytest.importorskip("healpy")

NSIDE = 4
NPIX = 12 * NSIDE**2
RNG = np.random.default_rng(1)
Q, U = RNG.standard_normal((2, NPIX)).astype(np.float32).astype(float)
Q.flags.writeable = U.flags.writeable = False


def write_table(path, columns, *, primary=(), **cards):
    """Write columns {name: (values, format, unit)} as a table with a HEALPix header and cards.

    A card of value None is left out.
    """
    table = fits.BinTableHDU.from_columns(
        [fits.Column(n, f, unit=unit, array=a) for n, (a, f, unit) in columns.items()]
    )
    header = {"PIXTYPE": "HEALPIX", "ORDERING": "RING", "NSIDE": NSIDE, "INDXSCHM": "IMPLICIT"}
    for name, value in {**header, **cards}.items():
        if value is not None:
            table.header[name] = value
    first = fits.PrimaryHDU(header=fits.Header(list(primary)))
    fits.HDUList([first, table]).writeto(path, overwrite=True)
    return path


def write_planck(path, **cards):
    """Write as Planck does: scalar rows, NESTED, Kcmb, further columns."""
    nested = [healpy.reorder(m, r2n=True) for m in (np.zeros(NPIX), Q, U, np.ones(NPIX))]
    names = ("I_STOKES", "Q_STOKES", "U_STOKES", "HITS")
    formats, units = ("E", "E", "E", "J"), ("Kcmb", "Kcmb", "Kcmb", None)
    columns = dict(zip(names, zip(nested, formats, units, strict=True), strict=True))
    given = {"ORDERING": "NESTED", "COORDSYS": "GALACTIC", "POLCCONV": "COSMO", **cards}
    return write_table(path, columns, BAD_DATA=UNSEEN, **given)


def write_one(path, values, name="BESTFIT", **cards):
    return write_table(path, {name: (values, "D", None)}, **cards)


def assert_equal_maps(maps, q=Q, u=U):
    np.testing.assert_array_equal(maps.q, q)
    np.testing.assert_array_equal(maps.u, u)


# Files of the world


def test_planck_layout_is_read(tmp_path):
    maps = read_polarisation(write_planck(tmp_path / "p.fits"))
    assert_equal_maps(maps)
    assert (maps.unit, maps.polconv, maps.coordinates) == ("Kcmb", "COSMO", "G")
    assert (maps.columns, maps.nside, maps.sentinel) == (("Q_STOKES", "U_STOKES"), NSIDE, None)


def test_wmap_pair_of_files_is_read_and_agrees_with_healpy():
    paths = wmap_synchrotron_paths()
    maps = read_polarisation(paths, columns="BESTFIT", polconv="COSMO", unit="mK_RJ")
    assert_equal_maps(maps, *(healpy.read_map(path, field=0, dtype=None) for path in paths))
    assert (maps.unit, maps.coordinates) == ("mK_RJ", "G")


@pytest.mark.parametrize("nside", [4, 16])
@pytest.mark.parametrize("nest", [False, True])
def test_healpy_files_are_read_in_rows_of_one_or_1024(tmp_path, nside, nest):
    maps = np.arange(3 * 12 * nside**2, dtype=np.float32).reshape(3, -1)
    stored = healpy.reorder(maps, r2n=True) if nest else maps
    path = tmp_path / "h.fits"
    healpy.write_map(path, stored, nest=nest, column_units="uK", dtype=np.float32)
    found = read_polarisation(path, polconv="COSMO")
    assert_equal_maps(found, maps[1], maps[2])
    assert found.columns == ("Q_POLARISATION", "U_POLARISATION")
    np.testing.assert_array_equal(read_map(path).values, maps[0])


def test_healpy_partial_files_are_read(tmp_path):
    """Pixels that the file does not list hold UNSEEN."""
    maps = np.array([Q, Q, U])
    maps[:, 5:90] = UNSEEN
    path = tmp_path / "partial.fits"
    healpy.write_map(path, maps, partial=True, dtype=np.float64)
    assert_equal_maps(read_polarisation(path, polconv="COSMO"), maps[1], maps[2])
    assert read_map(path, column=0).column == "TEMPERATURE"


def test_partial_nested_pixels_in_any_order_go_to_their_places(tmp_path):
    pixels = RNG.permutation(NPIX)[:50]
    columns = {"PIXEL": (pixels, "K", None), "SIGNAL": (np.arange(50.0), "D", "K")}
    scheme = {"ORDERING": "NESTED", "INDXSCHM": "EXPLICIT"}
    found = read_map(write_table(tmp_path / "cut.fits", columns, **scheme))
    expected = np.full(NPIX, UNSEEN)
    expected[healpy.nest2ring(NSIDE, pixels)] = np.arange(50.0)
    np.testing.assert_array_equal(found.values, expected)
    assert np.count_nonzero(bad_pixel_mask(found.values)) == NPIX - 50


def test_further_extensions_are_read_by_number(tmp_path):
    path = write_one(tmp_path / "cut.fits", Q)
    with fits.open(path, mode="append") as hdus:
        second = fits.BinTableHDU.from_columns([fits.Column("SIGNAL", "D", array=U)])
        second.header.extend([("ORDERING", "RING"), ("NSIDE", NSIDE)])
        hdus.append(second)
    np.testing.assert_array_equal(read_map(path, hdu=2).values, U)
    with pytest.raises(FileFormatError, match="has too few extensions; check hdu"):
        read_map(path, hdu=3)
    with pytest.raises(ParameterError, match="hdu=0 must be an integer >= 1"):
        read_map(path, hdu=0)


def test_gzip_file_is_read_as_the_plain_one_whatever_its_name(tmp_path):
    plain = write_planck(tmp_path / "p.fits").read_bytes()
    (tmp_path / "disguised.fits").write_bytes(gzip.compress(plain))
    assert_equal_maps(read_polarisation(tmp_path / "disguised.fits"))


def test_scaled_integers_are_read_as_their_values(tmp_path):
    """value = TZERO + TSCAL * stored"""
    stored = np.arange(NPIX, dtype=np.int16)
    path = write_table(tmp_path / "s.fits", {"T": (stored, "I", None)}, TSCAL1=0.5, TZERO1=3.0)
    with fits.open(path, mode="update") as hdus:
        hdus[1].header["TSCAL1"] = 0.5
    np.testing.assert_array_equal(read_map(path).values, 3 + 0.5 * stored)


def test_arrays_are_native_float64_and_locked(tmp_path):
    maps = read_polarisation(write_planck(tmp_path / "p.fits"))
    for values in (maps.q, maps.u):
        assert values.dtype == np.float64
        assert values.dtype.isnative
        assert not values.flags.writeable


def test_ring_maps_may_have_any_nside(tmp_path):
    path = write_one(tmp_path / "m.fits", np.arange(12.0 * 9), NSIDE=3)
    assert read_map(path).nside == 3
    assert read_map(write_one(tmp_path / "n.fits", np.arange(108.0), NSIDE=None)).nside == 3


# What a file leaves out, and what it says against its reader


def test_iau_file_has_the_sign_of_u_turned_except_at_bad_pixels(tmp_path):
    """U_COSMO = -U_IAU; UNSEEN and BAD_DATA keep their sign, or nobody knows them again."""
    u = U.copy()
    u[[3, 7]] = UNSEEN, -999.0
    columns = {"Q": (Q, "D", "K"), "U": (u, "D", "K")}
    path = write_table(tmp_path / "iau.fits", columns, POLCCONV="IAU", BAD_DATA=-999.0)
    found = read_polarisation(path)
    expected = -u
    expected[[3, 7]] = UNSEEN, -999.0
    assert_equal_maps(found, Q, expected)
    assert (found.polconv, found.sentinel) == ("COSMO", -999.0)


def test_convention_of_the_caller_counts_where_the_file_has_none(tmp_path):
    path = write_planck(tmp_path / "p.fits", POLCCONV=None)
    assert_equal_maps(read_polarisation(path, polconv="COSMO"), Q, U)
    assert_equal_maps(read_polarisation(path, polconv="iau"), Q, -U)


def test_keywords_of_the_primary_header_count_too(tmp_path):
    primary = [("ORDERING", "NESTED"), ("NSIDE", NSIDE), ("SKYCOORD", "Ecliptic")]
    nested = healpy.reorder(Q, r2n=True)
    path = write_one(tmp_path / "m.fits", nested, primary=primary, ORDERING=None, NSIDE=None)
    found = read_map(path)
    np.testing.assert_array_equal(found.values, Q)
    assert found.coordinates == "E"


MISSING = {
    "ordering": ({"ORDERING": None}, "has no ORDERING in its header; give ordering='RING' or "),
    "polconv": ({"POLCCONV": None}, "has no POLCCONV in its header; give polconv='COSMO' or "),
}


@pytest.mark.parametrize(("cards", "message"), MISSING.values(), ids=MISSING)
def test_what_changes_the_numbers_is_never_guessed(tmp_path, cards, message):
    path = write_planck(tmp_path / "p.fits", **cards)
    with pytest.raises(FileFormatError, match=message):
        read_polarisation(path)


def test_labels_nobody_gave_are_unknown(tmp_path):
    found = read_map(write_one(tmp_path / "m.fits", Q))
    assert (found.unit, found.coordinates) == ("unknown", "unknown")
    found = read_map(write_one(tmp_path / "m.fits", Q), unit="uK", coordinates="galactic")
    assert (found.unit, found.coordinates) == ("uK", "G")


@pytest.mark.parametrize(
    "stated",
    [{"ordering": "RING"}, {"polconv": "IAU"}, {"unit": "uK"}, {"coordinates": "C"}],
    ids=lambda stated: next(iter(stated)),
)
def test_argument_may_not_contradict_the_file(tmp_path, stated):
    path = write_planck(tmp_path / "p.fits")
    name = next(iter(stated))
    with pytest.raises(FileFormatError, match=f"against {name}=.*; leave out {name} or correct"):
        read_polarisation(path, **stated)


def test_argument_may_repeat_the_file(tmp_path):
    path = write_planck(tmp_path / "p.fits")
    stated = {"ordering": "nested", "polconv": "cosmo", "unit": "K_CMB", "coordinates": "G"}
    assert_equal_maps(read_polarisation(path, **stated))


@pytest.mark.parametrize("name", ["ordering", "polconv"])
def test_argument_must_be_one_of_its_words(tmp_path, name):
    with pytest.raises(ParameterError, match=f"{name}='FOO' must be '.*' or '.*'; leave it out"):
        read_polarisation(write_planck(tmp_path / "p.fits"), **{name: "FOO"})


@pytest.mark.parametrize(
    ("keyword", "value"),
    [
        ("ORDERING", "FOO"),
        ("ORDERING", 5),
        ("POLCCONV", "HEALPIX"),
        ("INDXSCHM", "SPARSE"),
        ("PIXTYPE", "CAR"),
    ],
)
def test_unknown_word_in_the_header_is_refused(tmp_path, keyword, value):
    path = write_planck(tmp_path / "p.fits", **{keyword: value})
    with pytest.raises(FileFormatError, match=f"has {keyword} = '?{value}'?, which must be one of"):
        read_polarisation(path)


# Columns


def test_column_is_found_by_name_in_any_case_or_by_number(tmp_path):
    path = write_planck(tmp_path / "p.fits")
    for column in ("Q_STOKES", "q_stokes", 1):
        np.testing.assert_array_equal(read_map(path, column=column).values, Q)
    assert_equal_maps(read_polarisation(path, columns=("U_STOKES", 1)), U, Q)


@pytest.mark.parametrize("column", ["Q", 4, -1, True, None, 1.0])
def test_column_that_is_not_there_is_refused_with_the_list_of_those_that_are(tmp_path, column):
    with pytest.raises(FileFormatError, match=r"has no column .* among \['I_STOKES', 'Q_STOKES'"):
        read_polarisation(
            write_planck(tmp_path / "p.fits"),
            columns=(column, 2) if column is not None else ("I", 2),
        )


def test_polarisation_columns_must_be_two(tmp_path):
    path = write_planck(tmp_path / "p.fits")
    for columns in ("Q_STOKES", (1,), (1, 2, 3)):
        with pytest.raises(ParameterError, match="must be the two columns of Q and U"):
            read_polarisation(path, columns=columns)
    with pytest.raises(ParameterError, match="are one column 'Q_STOKES'; name the two"):
        read_polarisation(path, columns=(1, "q_stokes"))


@pytest.mark.parametrize("names", [("GAMMA1", "gamma2"), ("Q-POLARISATION", "U-POLARISATION")])
def test_well_known_names_are_found(tmp_path, names):
    columns = {"X": (U, "D", None), names[0]: (Q, "D", None), names[1]: (U, "D", None)}
    assert_equal_maps(read_polarisation(write_table(tmp_path / "m", columns), polconv="COSMO"))


def test_unknown_names_need_the_columns_named(tmp_path):
    path = write_table(tmp_path / "m", {"A": (Q, "D", None), "B": (U, "D", None)})
    with pytest.raises(FileFormatError, match=r"among \['A', 'B'\]; name one of these"):
        read_polarisation(path, polconv="COSMO")
    with pytest.raises(FileFormatError, match=r"among \['A', 'B'\]; name one of these"):
        read_map(path)
    assert_equal_maps(read_polarisation(path, columns=("A", "B"), polconv="COSMO"))


def test_column_of_text_is_refused(tmp_path):
    path = write_table(tmp_path / "m", {"T": (np.full(NPIX, "abc"), "3A", None)})
    with pytest.raises(FileFormatError, match="has column 'T' of format 3A; name a column of real"):
        read_map(path)


# Pairs of files


def test_swapped_pair_is_refused_where_the_files_say_so():
    q, u = wmap_synchrotron_paths()
    with pytest.raises(FileFormatError, match="has STOKES = 'U' where Q is wanted; give the file"):
        read_polarisation((u, q), columns="BESTFIT", polconv="COSMO")


@pytest.mark.parametrize(
    ("cards", "message"),
    [
        ({"POLCCONV": "IAU"}, "has polconv 'IAU' for U where Q has 'COSMO'"),
        ({"COORDSYS": "C"}, "has coordinates 'C' for U where Q has 'G'"),
        ({"BAD_DATA": 0.0}, "has sentinel 0.0 for U where Q has None"),
    ],
)
def test_pair_must_agree(tmp_path, cards, message):
    first = write_planck(tmp_path / "q.fits")
    second = write_one(
        tmp_path / "u.fits", U, "U_STOKES", **{"POLCCONV": "COSMO", "COORDSYS": "G", **cards}
    )
    with pytest.raises(FileFormatError, match=message):
        read_polarisation([first, second], unit="Kcmb")


def test_pair_may_differ_in_order_but_not_in_nside(tmp_path):
    first = write_planck(tmp_path / "q.fits")
    given = {"POLCCONV": "COSMO", "COORDSYS": "G"}
    second = write_one(tmp_path / "u.fits", U, "U_STOKES", **given)
    assert_equal_maps(read_polarisation([first, second], unit="Kcmb"))
    third = write_one(tmp_path / "v.fits", np.zeros(48), "U", NSIDE=2, **given)
    with pytest.raises(FileFormatError, match="has 48 pixels for U where Q has 192; bring both"):
        read_polarisation([first, third], unit="Kcmb")


@pytest.mark.parametrize("paths", [("a",), ("a", "b", "c"), 7, {"a", "b"}])
def test_paths_are_one_or_two(paths):
    with pytest.raises(ParameterError, match="must be one path, or the path of Q and the path"):
        read_polarisation(paths)


# Damage and malice


def test_file_cut_anywhere_is_refused(tmp_path):
    whole = write_planck(tmp_path / "p.fits").read_bytes()
    for length in (*range(0, len(whole), 2880), 1, 79, 4000, len(whole) - 1):
        (tmp_path / "cut.fits").write_bytes(whole[:length])
        with pytest.raises(FileFormatError, match=r"is truncated|is not a FITS file|has too few"):
            read_polarisation(tmp_path / "cut.fits")


def test_gzip_file_cut_anywhere_is_refused(tmp_path):
    whole = gzip.compress(write_planck(tmp_path / "p.fits").read_bytes())
    for length in range(2, len(whole) - 8, 97):
        (tmp_path / "cut.gz").write_bytes(whole[:length])
        with pytest.raises(FileFormatError, match=r"cut\.gz"):
            read_polarisation(tmp_path / "cut.gz")


@pytest.mark.parametrize(
    "data", [b"", b"hello", b"PK\x03\x04" + bytes(3000), b"BZh9" + bytes(3000), bytes(9000)]
)
def test_what_is_no_fits_file_is_refused(tmp_path, data):
    (tmp_path / "x").write_bytes(data)
    with pytest.raises(FileFormatError, match="is not a FITS file; give a plain or gzip FITS file"):
        read_map(tmp_path / "x")


def test_url_is_refused():
    with pytest.raises(ParameterError, match="must be a local file, not a URL; download it first"):
        read_map("https://example.org/map.fits")


def test_header_without_end_is_refused(tmp_path):
    path = tmp_path / "endless.fits"
    path.write_bytes(b"SIMPLE  =                    T".ljust(2880) + b" " * 2880 * 1100)
    with pytest.raises(FileFormatError, match="has a header of more than"):
        read_map(path)


@pytest.mark.parametrize(
    ("pixels", "message"),
    [
        ([0, -1, 5], "has 1 PIXEL numbers outside 0 to 191"),
        ([0, 192, 5], "has 1 PIXEL numbers outside 0 to 191"),
        ([0, 5, 5], "lists 1 pixels more than once"),
    ],
)
def test_pixel_numbers_must_be_valid_and_distinct(tmp_path, pixels, message):
    columns = {"PIXEL": (np.array(pixels), "J", None), "T": (np.zeros(3), "D", None)}
    path = write_table(tmp_path / "m", columns, INDXSCHM="EXPLICIT")
    with pytest.raises(FileFormatError, match=message):
        read_map(path)


def test_partial_file_needs_integer_pixels(tmp_path):
    path = write_one(tmp_path / "m", np.zeros(3), INDXSCHM="EXPLICIT")
    with pytest.raises(FileFormatError, match="but no column PIXEL"):
        read_map(path)
    columns = {"PIXEL": (np.zeros(3), "D", None), "T": (np.zeros(3), "D", None)}
    with pytest.raises(FileFormatError, match="has 3 PIXEL values of type float64 for 3 values"):
        read_map(write_table(tmp_path / "m", columns, INDXSCHM="EXPLICIT"))


def test_small_partial_file_cannot_ask_for_much_memory(tmp_path):
    """A few kB that claim nside 8192 would fill 6 GB; the budget is checked before."""
    columns = {"PIXEL": (np.arange(3), "K", None), "T": (np.zeros(3), "D", None)}
    path = write_table(tmp_path / "m", columns, INDXSCHM="EXPLICIT", NSIDE=8192)
    tracemalloc.start()
    with pytest.raises(MemoryBudgetError, match="; raise max_memory or degrade the map first"):
        read_map(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2**20


@pytest.mark.parametrize("ordering", ["RING", "NESTED"])
@pytest.mark.parametrize("polconv", ["COSMO", "IAU"])
@pytest.mark.parametrize("is_partial", [False, True])
def test_reading_takes_no_more_memory_than_was_checked(tmp_path, ordering, polconv, is_partial):
    """A budget that suffices by the error's own count is not exceeded."""
    columns = {name: (np.arange(12.0 * 64**2), "D", None) for name in "QU"}
    cards = {"ORDERING": ordering, "POLCCONV": polconv, "NSIDE": 64}
    if is_partial:
        columns["PIXEL"] = np.arange(12 * 64**2), "K", None
        cards["INDXSCHM"] = "EXPLICIT"
    path = write_table(tmp_path / "m.fits", columns, **cards)
    with pytest.raises(MemoryBudgetError) as refusal:
        read_polarisation(path, max_memory=1)
    budget = int(re.search(r"less than the (\d+) bytes", str(refusal.value))[1])
    read_polarisation(path)
    tracemalloc.start()
    read_polarisation(path, max_memory=budget)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1.05 * budget


def test_memory_budget_is_held_against_the_maps(tmp_path):
    path = write_planck(tmp_path / "p.fits")
    with pytest.raises(MemoryBudgetError, match="max_memory=4000 bytes is less than the 9216"):
        read_polarisation(path, max_memory=4000)
    assert_equal_maps(read_polarisation(path, max_memory=9216))
    for wrong in (0, -1, 1.5, "4G"):
        with pytest.raises(ParameterError, match="must be a positive number of bytes, or None"):
            read_polarisation(path, max_memory=wrong)


@pytest.mark.parametrize(
    ("keyword", "value"),
    [("NAXIS2", 999999999999), ("NAXIS1", -8), ("PCOUNT", 10**15), ("NAXIS2", 1.5), ("NAXIS1", 7)],
)
def test_header_that_promises_other_sizes_is_refused(tmp_path, keyword, value):
    path = write_one(tmp_path / "m.fits", Q)
    with fits.open(path) as hdus:
        header, data = hdus[1].header, path.read_bytes()[-5760:]
        header[keyword] = value
        path.write_bytes(path.read_bytes()[:2880] + header.tostring().encode() + data)
    with pytest.raises(FileFormatError, match=r"is truncated|where an integer|has rows of"):
        read_map(path)


@pytest.mark.parametrize("nside", [0, -4, 5, 16384, "4", 4.0])
def test_nside_must_fit_the_order_and_the_pixels(tmp_path, nside):
    path = write_one(tmp_path / "m.fits", Q, ORDERING="NESTED", NSIDE=nside)
    with pytest.raises(FileFormatError, match=r"has NSIDE = .* in NESTED order; NSIDE must be"):
        read_map(path)


def test_pixel_count_must_be_that_of_nside(tmp_path):
    path = write_one(tmp_path / "m.fits", Q, NSIDE=8)
    with pytest.raises(FileFormatError, match="holds 192 pixels where NSIDE = 8 has 768"):
        read_map(path)


def test_image_is_no_table(tmp_path):
    fits.HDUList([fits.PrimaryHDU(), fits.ImageHDU(np.zeros((3, 3)))]).writeto(tmp_path / "i.fits")
    with pytest.raises(FileFormatError, match="has no binary table in extension 1"):
        read_map(tmp_path / "i.fits")


@given(st.data())
def test_altered_header_gives_a_map_or_our_error(tmp_path_factory, data):
    """Whatever bytes stand in the headers, nothing but our exceptions comes out."""
    folder = tmp_path_factory.mktemp("fuzz")
    content = bytearray(write_planck(folder / "p.fits").read_bytes())
    places = st.integers(0, 2 * 2880 + 2000)
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(places)] = data.draw(st.sampled_from(b" 0139'=TEJKPQ/\x00\xff"))
    (folder / "p.fits").write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with contextlib.suppress(SpinsdwError):
            maps = read_polarisation(folder / "p.fits", max_memory=10**7)
            assert maps.q.size == 12 * maps.nside**2


# Masks


def test_mask_is_read_as_weights_and_unlisted_pixels_are_hidden(tmp_path):
    columns = {"PIXEL": (np.arange(90), "J", None), "MASK": (np.ones(90, bool), "L", None)}
    path = write_table(tmp_path / "m", columns, INDXSCHM="EXPLICIT", BAD_DATA=UNSEEN)
    np.testing.assert_array_equal(read_mask(path), np.arange(NPIX) < 90)


@pytest.mark.parametrize("value", [-0.1, 1.1, np.nan, np.inf])
def test_mask_outside_zero_to_one_is_refused(tmp_path, value):
    weights = np.ones(NPIX)
    weights[3] = value
    with pytest.raises(DataError, match=r"has 1 values outside \[0, 1\] in column 'BESTFIT'"):
        read_mask(write_one(tmp_path / "m", weights))


# Objects


def test_objects_check_themselves():
    with pytest.raises(ShapeError, match="values has shape"):
        HealpixMap(np.zeros((2, 12)))
    with pytest.raises(ShapeError, match="12 nside"):
        HealpixMap(np.zeros(13))
    with pytest.raises(ShapeError, match="give two maps of one nside"):
        PolarisationMaps(np.zeros(12), np.zeros(48))
    with pytest.raises(ParameterError, match="polconv='FOO' must be"):
        PolarisationMaps(np.zeros(12), np.zeros(12), polconv="FOO")
    assert HealpixMap(np.zeros(12)).nside == 1


# Writing


@pytest.mark.parametrize("ordering", ["RING", "NESTED"])
@pytest.mark.parametrize("nside", [4, 16])
def test_written_maps_are_read_back_bit_for_bit(tmp_path, ordering, nside):
    q, u = RNG.standard_normal((2, 12 * nside**2))
    q[3] = UNSEEN
    maps = {"Q_STOKES": q, "U_STOKES": u}
    labels = {"unit": "K_CMB", "polconv": "COSMO", "coordinates": "G", "ordering": ordering}
    path = write_maps(tmp_path / "qu.fits", maps, dtype="float64", **labels)
    found = read_polarisation(path)
    assert_equal_maps(found, q, u)
    assert (found.unit, found.coordinates, found.polconv) == ("K_CMB", "G", "COSMO")
    stored = healpy.read_map(path, field=(0, 1), dtype=None, nest=None)
    expected = [healpy.reorder(m, r2n=True) for m in (q, u)] if ordering == "NESTED" else [q, u]
    np.testing.assert_array_equal(stored, expected)
    np.testing.assert_array_equal(healpy.read_map(path, field=1, dtype=None), u)


def test_single_precision_keeps_single_precision(tmp_path):
    path = write_maps(tmp_path / "t.fits", {"T": Q / 3}, unit="uK")
    np.testing.assert_array_equal(read_map(path).values, (Q / 3).astype(np.float32))


def test_header_says_all_a_reader_needs(tmp_path):
    maps, history = {"Q_STOKES": Q, "U_STOKES": U}, ["lmax 512", "x" * 100]
    labels = {"unit": "uK_CMB", "polconv": "IAU", "coordinates": "C", "history": history}
    path = write_maps(tmp_path / "qu.fits", maps, **labels)
    with fits.open(path, checksum=True) as hdus:
        hdus.verify("exception")
        header = hdus[1].header
        expected = {
            "PIXTYPE": "HEALPIX",
            "ORDERING": "RING",
            "NSIDE": NSIDE,
            "FIRSTPIX": 0,
            "LASTPIX": NPIX - 1,
            "INDXSCHM": "IMPLICIT",
            "OBJECT": "FULLSKY",
            "COORDSYS": "C",
            "POLAR": True,
            "POLCCONV": "IAU",
            "BAD_DATA": UNSEEN,
            "TTYPE1": "Q_STOKES",
            "TUNIT1": "uK_CMB",
            "TFORM2": "E",
        }
        assert {name: header[name] for name in expected} == expected
        assert str(header["HISTORY"]).startswith("Written by spinsdw ")
        assert "lmax 512" in str(header["HISTORY"])


def test_labels_that_are_unknown_are_not_written(tmp_path):
    path = write_maps(tmp_path / "t.fits", {"T": Q}, unit="unknown", coordinates="unknown")
    found = read_map(path)
    assert (found.unit, found.coordinates) == ("unknown", "unknown")
    header = fits.getheader(path, 1)
    assert not {"TUNIT1", "COORDSYS", "POLCCONV"} & set(header)


def test_same_maps_make_the_same_bytes(tmp_path):
    first, second = (
        write_maps(tmp_path / name, {"T": Q}, unit="uK").read_bytes() for name in ("a", "b")
    )
    assert first == second


def test_output_is_not_overwritten_unasked(tmp_path):
    path = write_maps(tmp_path / "t.fits", {"T": Q}, unit="uK")
    with pytest.raises(OutputExistsError, match="exists already; give another name or overwrite"):
        write_maps(path, {"T": U}, unit="uK")
    write_maps(path, {"T": U}, unit="uK", overwrite=True)
    np.testing.assert_array_equal(read_map(path).values, U)


REFUSED = {
    "gzip name": ({}, {"path": "t.fits.gz"}, ParameterError, "must not end in .gz"),
    "no map": ({"maps": {}}, {}, ParameterError, "must be distinct names, one or more"),
    "one name": ({"maps": {"T": Q, "t": Q}}, {}, ParameterError, "must be distinct names"),
    "unit": ({"unit": "µK"}, {}, ParameterError, "must be printable ASCII"),
    "history": ({"history": ["a\nb"]}, {}, ParameterError, "must be printable ASCII"),
    "convention": ({"maps": {"Q": Q}}, {}, ParameterError, "polconv=None must be 'COSMO' or"),
    "order": ({"ordering": "FOO"}, {}, ParameterError, "ordering='FOO' must be 'RING' or"),
    "dtype": ({"dtype": "int16"}, {}, ParameterError, "dtype='int16' must be 'float32' or"),
    "complex": ({"maps": {"T": Q + 0j}}, {}, DataError, "must be real; write parts apart"),
    "masked": ({"maps": {"T": np.ma.array(Q)}}, {}, DataError, "fill masked pixels"),
    "large": ({"maps": {"T": 1e39 * np.ones(12)}}, {}, DataError, "pass dtype='float64'"),
    "sizes": ({"maps": {"T": Q, "V": Q[:12]}}, {}, ShapeError, "give whole-sky maps of one"),
    "stack": ({"maps": {"T": np.zeros((2, 12))}}, {}, ShapeError, "give whole-sky maps of one"),
    "count": ({"maps": {"T": np.zeros(13)}}, {}, ShapeError, "12 nside"),
    "nested": (
        {"maps": {"T": np.zeros(108)}, "ordering": "NESTED"},
        {},
        ParameterError,
        "must be a power of two for NESTED",
    ),
}


@pytest.mark.parametrize(("change", "place", "error", "message"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_written_is_refused_and_leaves_no_file(
    tmp_path, change, place, error, message
):
    arguments = {"maps": {"T": Q}, "unit": "uK", **change}
    with pytest.raises(error, match=message):
        write_maps(tmp_path / place.get("path", "t.fits"), **arguments)
    assert not list(tmp_path.iterdir())
