"""Wavelet coefficients come back from a file bit for bit, or not at all."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from spinsdw.coefficients import WaveletCoefficients
from spinsdw.datasets import wmap_mask_path
from spinsdw.errors import (
    DataError,
    FileFormatError,
    MemoryBudgetError,
    MissingPackageError,
    OutputExistsError,
    ParameterError,
)
from spinsdw.maps_io import read_coefficients, write_coefficients
from spinsdw.wavelet_transform import SpinWaveletTransform
from tests.helpers import assert_close, random_flm

pytest.importorskip("zarr")


@pytest.fixture(autouse=True)
def _leave_flushing_to_the_system(monkeypatch):
    """Every chunk is a file, and flushing hundreds of them takes longer than all else."""
    monkeypatch.setattr("os.fsync", lambda _: None)


def make_coefficients(*, real=False, batch=()):
    def draw(seed, *shape):
        count = int(np.prod(shape))
        side = int(np.ceil(np.sqrt(count)))
        values = random_flm(side, seed=seed)[:count].reshape(shape)
        return values.real.copy() if real else values

    parameters = {
        "bandlimit": 8,
        "spin": 0 if real else 2,
        "directions": 3,
        "dilation": 1.1 ** (1 / 7),
        "lowest_scale": 1,
        "sampling": "mw",
        "multiresolution": True,
        "real": real,
    }
    scales = {j: draw(j, *batch, 3, 2**j, 2 ** (j + 1) - 1) for j in (1, 2, 3)}
    return WaveletCoefficients(draw(0, *batch, 2, 3), scales, parameters)


FORMS = pytest.mark.parametrize("name", ["w.fits", "w.zarr"])


@FORMS
@pytest.mark.parametrize("dtype", ["float32", "float64", "complex64", "complex128"])
@pytest.mark.parametrize("batch", [(), (2,), (2, 1), (0,)])
def test_written_coefficients_are_read_back_bit_for_bit(tmp_path, name, dtype, batch):
    real = dtype.startswith("float")
    written = make_coefficients(real=real, batch=batch).map(lambda v: v.astype(dtype))
    found = read_coefficients(write_coefficients(tmp_path / name, written))
    assert found.parameters == written.parameters
    assert found.shapes == written.shapes
    for key in ("scaling", *written):
        one, other = (c.scaling if key == "scaling" else c[key] for c in (found, written))
        assert one.dtype == other.dtype
        assert one.tobytes() == other.tobytes()


@FORMS
@pytest.mark.parametrize("special", [np.nan, -np.inf, -0.0, 5e-324])
def test_every_number_is_kept(tmp_path, name, special):
    written = make_coefficients().map({2: lambda v: np.full_like(v, special)})
    found = read_coefficients(write_coefficients(tmp_path / name, written))
    assert found[2].tobytes() == written[2].tobytes()


@FORMS
@pytest.mark.parametrize("dtype", [np.int64, np.float16, np.longdouble, bool])
def test_other_types_are_refused(tmp_path, name, dtype):
    coefficients = make_coefficients(real=True).map({2: lambda v: v.astype(dtype)})
    with pytest.raises(DataError, match=r"scale 2 has dtype .* but must have one of float32, "):
        write_coefficients(tmp_path / name, coefficients)
    assert not list(tmp_path.iterdir())


@FORMS
def test_an_analysis_is_kept_for_its_synthesis(tmp_path, name):
    transform = SpinWaveletTransform(12, 2, 3, lowest_scale=1)
    flm = random_flm(12, 2)
    path = write_coefficients(tmp_path / name, transform.analysis_harmonic(flm))
    found = transform.synthesis_harmonic(read_coefficients(path))
    assert_close(found, flm, ulps=256)


@FORMS
def test_coefficients_are_replaced_only_when_asked(tmp_path, name):
    path = write_coefficients(tmp_path / name, make_coefficients())
    other = make_coefficients(batch=(2,))
    with pytest.raises(OutputExistsError, match="exists already"):
        write_coefficients(path, other)
    assert read_coefficients(path).shapes == make_coefficients().shapes
    write_coefficients(path, other, overwrite=True)
    assert read_coefficients(path).shapes == other.shapes
    assert [place.name for place in tmp_path.iterdir()] == [name]


def test_store_has_a_file_for_each_signal_and_orientation(tmp_path):
    path = write_coefficients(tmp_path / "w.zarr", make_coefficients(batch=(2,)))
    chunks = [place for place in (path / "SCALE_2" / "c").rglob("*") if place.is_file()]
    assert len(chunks) == 2 * 3
    assert {place.stat().st_size for place in chunks} == {4 * 7 * 16 + 4}


def test_large_maps_are_cut_into_chunks_of_rings(tmp_path, monkeypatch):
    monkeypatch.setattr("spinsdw.maps_io.store.LARGEST_CHUNK", 500)
    written = make_coefficients()
    path = write_coefficients(tmp_path / "w.zarr", written)
    assert len(list((path / "SCALE_3" / "c" / "0").iterdir())) == 4
    assert np.array_equal(read_coefficients(path)[3], written[3])


def test_every_file_of_a_store_is_checked(tmp_path):
    """Each in turn: a flipped bit, one byte fewer, gone; all are noticed."""
    path = write_coefficients(tmp_path / "w.zarr", make_coefficients())
    for file in [place for place in path.rglob("*") if place.is_file()]:
        whole = file.read_bytes()
        flipped = bytearray(whole)
        flipped[len(whole) // 2] ^= 1
        for data in (bytes(flipped), whole[:-1], None):
            if data is None:
                file.unlink()
            else:
                file.write_bytes(data)
            with pytest.raises(FileFormatError, match="path="):
                read_coefficients(path)
        file.write_bytes(whole)
    read_coefficients(path)


def change_metadata(path, changes):
    metadata = json.loads(path.read_bytes())
    path.write_text(json.dumps(metadata | changes))


HOSTILE = [
    {"shape": [3, 2**40, 2**40]},
    {"shape": [0, 2**62, 2**62]},
    {"shape": [-1, 4, 7]},
    {"shape": "all"},
    {"shape": [3, 4]},
    {"data_type": "string"},
    {"data_type": {"name": "null_terminated_bytes"}},
    {"codecs": [{"name": "numcodecs.pickle"}]},
    {"codecs": [{"name": "bytes"}, {"name": "zstd"}]},
    {"fill_value": {"a": 1}},
    {"chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [0, 0, 0]}}},
    {"zarr_format": 2},
    {"node_type": "group"},
]


@pytest.mark.parametrize("changes", HOSTILE, ids=str)
def test_metadata_that_are_not_ours_are_refused(tmp_path, changes):
    path = write_coefficients(tmp_path / "w.zarr", make_coefficients())
    change_metadata(path / "SCALE_2" / "zarr.json", changes)
    with pytest.raises(FileFormatError, match="give a store that write_coefficients wrote"):
        read_coefficients(path)


@pytest.mark.parametrize("changes", [{"attributes": {}}, {"attributes": 3}, {"node_type": "array"}])
def test_group_must_be_marked_as_ours(tmp_path, changes):
    path = write_coefficients(tmp_path / "w.zarr", make_coefficients())
    change_metadata(path / "zarr.json", changes)
    with pytest.raises(FileFormatError, match="give a store that write_coefficients wrote"):
        read_coefficients(path)


def test_store_needs_memory_within_its_budget(tmp_path):
    path = write_coefficients(tmp_path / "w.zarr", make_coefficients())
    with pytest.raises(MemoryBudgetError, match="max_memory=100 bytes"):
        read_coefficients(path, max_memory=100)


def test_what_is_no_store_is_refused_and_never_replaced(tmp_path):
    with pytest.raises(FileFormatError, match="does not exist; give a store"):
        read_coefficients(tmp_path / "absent.zarr")
    directory = tmp_path / "mine.zarr"
    directory.mkdir()
    (directory / "thesis.tex").write_text("all of it")
    with pytest.raises(FileFormatError, match="is no Zarr store"):
        read_coefficients(directory)
    with pytest.raises(ParameterError, match=r"holds no zarr.json and is not replaced"):
        write_coefficients(directory, make_coefficients(), overwrite=True)
    assert (directory / "thesis.tex").read_text() == "all of it"


def test_stores_need_zarr(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(MissingPackageError, match=r"pip install 'spinsdw\[zarr\]'"):
        write_coefficients(tmp_path / "w.zarr", make_coefficients())
    with pytest.raises(MissingPackageError, match=r"pip install 'spinsdw\[zarr\]'"):
        read_coefficients(tmp_path / "w.zarr")


def test_coefficient_file_is_checked_to_the_last_byte(tmp_path):
    path = write_coefficients(tmp_path / "w.fits", make_coefficients())
    whole = path.read_bytes()
    damaged = bytearray(whole)
    damaged[len(whole) - 5000] ^= 1
    for data in (damaged, *(whole[:end] for end in (*range(0, len(whole), 2880), -1))):
        path.write_bytes(data)
        with pytest.raises(FileFormatError, match=r"fails|is truncated|has the ext|is not a FITS"):
            read_coefficients(path)


def test_file_of_something_else_holds_no_coefficients(tmp_path):
    with pytest.raises(FileFormatError, match="has no card PARAMS with parameters; give a file"):
        read_coefficients(wmap_mask_path())
    path = write_coefficients(tmp_path / "w.fits", make_coefficients())
    with pytest.raises(MemoryBudgetError, match="max_memory=100 bytes"):
        read_coefficients(path, max_memory=100)


def test_parameters_without_a_plain_form_are_refused(tmp_path):
    coefficients = make_coefficients()
    for odd in (object(), np.nan, 1j):
        parameters = {**coefficients.parameters, "odd": odd}
        scales = {j: coefficients[j] for j in coefficients.scales}
        changed = WaveletCoefficients(coefficients.scaling, scales, parameters)
        with pytest.raises(ParameterError, match="must be numbers, texts or lists of them"):
            write_coefficients(tmp_path / "w.fits", changed)
