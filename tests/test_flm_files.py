"""Harmonic coefficients in files, also as healpy writes and reads them."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.io import fits

from spinsdw.datasets import wmap_mask_path
from spinsdw.errors import (
    DataError,
    FileFormatError,
    MemoryBudgetError,
    OutputExistsError,
    ParameterError,
    ShapeError,
)
from spinsdw.healpix import alm_to_flm, flm_to_alm
from spinsdw.maps_io import read_flm, write_flm
from tests.helpers import random_flm, random_real_flm

hp = pytest.importorskip("healpy")


def real_flm(bandlimit, seed=0):
    """Draw a field that is real to the last bit, as a file has to keep it."""
    flm = random_real_flm(bandlimit, seed=seed)
    return alm_to_flm(flm_to_alm(flm), bandlimit)


@pytest.mark.parametrize("bandlimit", [1, 2, 3, 12])
def test_written_coefficients_are_read_back_bit_for_bit(tmp_path, bandlimit):
    fields = {
        "P": random_flm(bandlimit, min(2, bandlimit - 1), seed=1),
        "E": real_flm(bandlimit, seed=2),
        "ZERO": np.zeros(bandlimit**2),
    }
    fields["P"][-1] = 1 + 2j
    found = read_flm(write_flm(tmp_path / "a.fits", fields))
    assert list(found) == list(fields)
    for name, flm in fields.items():
        assert found[name].shape == flm.shape
        assert np.array_equal(found[name], flm)


def test_healpy_reads_our_real_fields(tmp_path):
    fields = {"E": real_flm(9, 1), "B": real_flm(9, 2)}
    path = write_flm(tmp_path / "a.fits", fields)
    for hdu, flm in enumerate(fields.values(), start=1):
        alm, mmax = hp.read_alm(path, hdu=hdu, return_mmax=True)
        assert mmax == 8
        assert np.array_equal(alm_to_flm(alm, 9), flm)


@pytest.mark.parametrize("fields", [1, 3])
def test_files_of_healpy_are_read(tmp_path, fields):
    alms = [flm_to_alm(real_flm(9, seed)) for seed in range(fields)]
    hp.write_alm(tmp_path / "a.fits", alms if fields > 1 else alms[0], out_dtype=np.float64)
    found = read_flm(tmp_path / "a.fits")
    assert len(found) == fields
    for flm, alm in zip(found.values(), alms, strict=True):
        assert np.array_equal(flm, alm_to_flm(alm, 9))


def write_table(path, index, values):
    columns = [
        fits.Column(name=name, format=code, array=part)
        for name, code, part in zip(
            ("index", "real", "imag"), "KDD", (index, values, values), strict=True
        )
    ]
    fits.HDUList([fits.PrimaryHDU(), fits.BinTableHDU.from_columns(columns)]).writeto(path)
    return path


@pytest.mark.parametrize("index", [[0, 1], [1, 1], [1, 2**40], [-3, 1]])
def test_bad_indices_are_refused(tmp_path, index):
    path = write_table(tmp_path / "a.fits", np.array(index), np.ones(2))
    with pytest.raises(FileFormatError, match="that are not distinct, or from 1 to"):
        read_flm(path)


def test_a_small_file_cannot_ask_for_much_memory(tmp_path):
    path = write_table(tmp_path / "a.fits", np.array([2**29]), np.ones(1))
    with pytest.raises(MemoryBudgetError, match="max_memory="):
        read_flm(path)


def test_files_of_another_kind_are_refused(tmp_path):
    with pytest.raises(FileFormatError, match="has the columns"):
        read_flm(wmap_mask_path())
    path = write_flm(tmp_path / "a.fits", {"P": random_flm(8)})
    whole = path.read_bytes()
    path.write_bytes(whole[:-2880])
    with pytest.raises(FileFormatError, match="is truncated"):
        read_flm(path)
    path = write_table(tmp_path / "n.fits", np.array([1]), np.array([np.nan]))
    with pytest.raises(DataError, match="finite"):
        read_flm(path)
    fits.PrimaryHDU().writeto(tmp_path / "e.fits")
    with pytest.raises(FileFormatError, match="has no tables"):
        read_flm(tmp_path / "e.fits")


@pytest.mark.parametrize(
    ("fields", "error", "message"),
    [
        ({}, ParameterError, r"fields has the names \[\]"),
        ({"a b": np.ones(4)}, ParameterError, "must be plain words"),
        ({"E": np.ones(4), "e": np.ones(4)}, ParameterError, "must differ by more than upper case"),
        ({"E": np.ones(5)}, ShapeError, r"must be bandlimit\*\*2 long"),
        ({"E": np.full(4, np.nan)}, DataError, "finite"),
        ({"E": np.ones((2, 4))}, ParameterError, "write each field of a batch"),
    ],
)
def test_what_cannot_be_written_leaves_no_file(tmp_path, fields, error, message):
    with pytest.raises(error, match=message):
        write_flm(tmp_path / "a.fits", fields)
    assert not list(tmp_path.iterdir())


def test_files_are_not_replaced_unasked(tmp_path):
    path = write_flm(tmp_path / "a.fits", {"E": np.ones(1)})
    with pytest.raises(OutputExistsError, match="exists already"):
        write_flm(path, {"E": np.ones(4)})
    assert read_flm(write_flm(path, {"E": np.ones(4)}, overwrite=True))["E"].size == 4
