"""Maps on exact grids in files, also as S2LET writes them."""

from __future__ import annotations

import gzip

import numpy as np
import pytest
from astropy.io import fits

from spinsdw.datasets import wmap_mask_path
from spinsdw.errors import (
    DataError,
    FileFormatError,
    MemoryBudgetError,
    OutputExistsError,
    ShapeError,
)
from spinsdw.maps_io import read_grid_map, write_grid_map
from spinsdw.sampling import MW, MWSS, resolve_sampling
from tests.helpers import random_like


def random_map(sampling, dtype, seed=0):
    return random_like(np.empty(sampling.shape, dtype), seed)


@pytest.mark.parametrize("name", ["mw", "mwss", "dh", "gl", "cc", "fejer1"])
@pytest.mark.parametrize("bandlimit", [1, 2, 5])
@pytest.mark.parametrize("dtype", [float, complex])
def test_written_maps_are_read_back_bit_for_bit(tmp_path, name, bandlimit, dtype):
    sampling = resolve_sampling(name, bandlimit)
    values = random_map(sampling, dtype)
    path = write_grid_map(tmp_path / "f.fits", values, sampling, unit="uK")
    found, grid = read_grid_map(path)
    assert grid == sampling
    assert found.dtype == values.dtype
    assert found.tobytes() == values.tobytes()


def s2let_file(path, sampling, columns, **cards):
    """Write what s2let_fits_mw_write_map and its kin write: no more cards than those."""
    table = fits.BinTableHDU.from_columns(
        [fits.Column(name=name, format="1D", unit=" ", array=v) for name, v in columns.items()]
    )
    table.header["L"] = sampling.bandlimit
    if sampling.name == "mwss":
        table.header["MWSS"] = 1
    table.header.update(cards)
    fits.HDUList([fits.PrimaryHDU(), table]).writeto(path)
    return path


@pytest.mark.parametrize("sampling", [MW(6), MWSS(6)], ids=str)
def test_files_of_s2let_are_read(tmp_path, sampling):
    """SIGNAL, or Q_POLARISATION and U_POLARISATION, ring by ring; L and maybe MWSS."""
    q, u = random_map(sampling, float, 1), random_map(sampling, float, 2)
    path = s2let_file(tmp_path / "f.fits", sampling, {"SIGNAL": q.ravel()})
    found, grid = read_grid_map(path)
    assert grid == sampling
    assert np.array_equal(found, q)
    pair = {"Q_POLARISATION": q.ravel(), "U_POLARISATION": u.ravel()}
    found, grid = read_grid_map(s2let_file(tmp_path / "p.fits", sampling, pair))
    assert grid == sampling
    assert np.array_equal(found, q + 1j * u)


@pytest.mark.parametrize("sampling", [MW(6), MWSS(6)], ids=str)
@pytest.mark.parametrize("dtype", [float, complex])
def test_s2let_finds_in_our_files_what_it_looks_for(tmp_path, sampling, dtype):
    """A table in extension 1 with one double a row, NAXIS2 samples, L, and MWSS = 1 or no MWSS."""
    values = random_map(sampling, dtype)
    with fits.open(write_grid_map(tmp_path / "f.fits", values, sampling)) as hdus:
        table = hdus[1]
        assert table.header["L"] == sampling.bandlimit
        assert table.header.get("MWSS") == (1 if sampling.name == "mwss" else None)
        assert table.header["NAXIS2"] == values.size
        assert set(table.columns.formats) <= {"D", "1D"}
        assert np.array_equal(table.data.field(0), values.real.ravel())
        if dtype is complex:
            assert np.array_equal(table.data.field(1), values.imag.ravel())


def test_compressed_and_single_precision_files_are_read(tmp_path):
    """S2LET comes with maps of single precision, many samples a row."""
    sampling = MW(4)
    values = random_map(sampling, float).astype(np.float32)
    column = fits.Column(name="SIGNAL", format="7E", array=values.reshape(4, 7))
    table = fits.BinTableHDU.from_columns([column])
    table.header["L"] = 4
    path = tmp_path / "f.fits"
    fits.HDUList([fits.PrimaryHDU(), table]).writeto(path)
    packed = tmp_path / "f.fits.gz"
    packed.write_bytes(gzip.compress(path.read_bytes()))
    for one in (path, packed):
        found, _ = read_grid_map(one)
        assert found.dtype == np.float64
        assert np.array_equal(found, values)


def test_files_of_another_kind_are_refused(tmp_path):
    sampling = MW(4)
    values = random_map(sampling, float).ravel()
    with pytest.raises(FileFormatError, match="path="):
        read_grid_map(wmap_mask_path())
    bad = [
        ({"SIGNAL": values}, {"L": 5}, "has 28 values in 'SIGNAL', not the 5 x 9"),
        ({"SIGNAL": values}, {"L": -1}, "has L = -1 in its header"),
        ({"SIGNAL": values}, {"L": 0}, "has L = 0 and SAMPLING = 'mw'"),
        ({"SIGNAL": values}, {"SAMPLING": "pancake"}, "SAMPLING = 'pancake'"),
        ({"OTHER": values}, {}, r"has the columns \['OTHER'\]"),
        ({"Q_POLARISATION": values}, {}, r"has the columns \['Q_POLARISATION'\]"),
    ]
    for i, (columns, cards, message) in enumerate(bad):
        path = s2let_file(tmp_path / f"{i}.fits", sampling, columns, **cards)
        with pytest.raises(FileFormatError, match=message):
            read_grid_map(path)
    path = s2let_file(tmp_path / "n.fits", sampling, {"SIGNAL": np.full(28, np.nan)})
    with pytest.raises(DataError, match="not finite"):
        read_grid_map(path)


def test_memory_and_truncation_are_checked(tmp_path):
    path = write_grid_map(tmp_path / "f.fits", random_map(MW(16), complex), MW(16))
    with pytest.raises(MemoryBudgetError, match="max_memory=100 bytes"):
        read_grid_map(path, max_memory=100)
    whole = path.read_bytes()
    path.write_bytes(whole[:-2880])
    with pytest.raises(FileFormatError, match="is truncated"):
        read_grid_map(path)


def test_what_is_no_map_of_the_grid_is_not_written(tmp_path):
    path = tmp_path / "f.fits"
    with pytest.raises(ShapeError, match="map has shape"):
        write_grid_map(path, np.ones((3, 3)), MW(4))
    with pytest.raises(DataError, match="but a file holds one"):
        write_grid_map(path, np.ones((2, 4, 7)), MW(4))
    with pytest.raises(DataError, match="not finite"):
        write_grid_map(path, np.full((4, 7), np.inf), MW(4))
    assert not list(tmp_path.iterdir())
    write_grid_map(path, np.ones((4, 7)), MW(4))
    with pytest.raises(OutputExistsError, match="exists already"):
        write_grid_map(path, np.ones((4, 7)), MW(4))
