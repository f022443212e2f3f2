"""Laws of the command line, on files of a few kilobytes."""

from __future__ import annotations

import errno
import inspect
import io
import re
import subprocess
import sys
import warnings
from typing import get_args

import click
import numpy as np
import pytest
from astropy.io import fits
from click.testing import CliRunner

from spinsdw.cli import main
from spinsdw.cli.commands import METHODS, OUTPUTS, separate
from spinsdw.cli.environment import describe
from spinsdw.cli.outputs import PICTURES
from spinsdw.cli.progress import progress
from spinsdw.harmonics import eb_to_spin, multiply_by_degree, polarisation_factor
from spinsdw.healpix import UNSEEN, flm_to_map
from spinsdw.maps_io import read_coefficients, read_map, write_maps
from spinsdw.masks import galactic_cut, sky_fraction
from spinsdw.polarisation import EBSeparator, Output
from spinsdw.separation import Pseudo, registry
from spinsdw.simulation import gaussian_flm
from tests.helpers import assert_close

NSIDE, BANDLIMIT = 4, 9
NPIX = 12 * NSIDE**2
# Files hold float32: half its rounding, in units of that of float64.
FLOAT32_ULPS = 2.0**28
STATED = {"unit": "uK", "polconv": "COSMO", "coordinates": "G"}
HEAVY = {"numba", "healpy", "astropy", "matplotlib", "scipy", "numpy", "ducc0", "rich"}


def coefficients():
    """Return E and B coefficients of one sky, of different power."""
    spectrum = np.ones(BANDLIMIT)
    spectrum[:2] = 0
    e_lm = gaussian_flm(spectrum, BANDLIMIT, seed=1)
    return e_lm, gaussian_flm(spectrum / 4, BANDLIMIT, seed=2)


def stokes():
    """Return Q and U that hold no degree beyond the default bandlimit of their nside."""
    p = flm_to_map(eb_to_spin(*coefficients()), NSIDE, 2)
    return p.real.copy(), p.imag.copy()


def write_stokes(path, q, u, names=("Q_STOKES", "U_STOKES"), **labels):
    maps = dict(zip(names, (q, u), strict=True))
    return str(write_maps(path, maps, dtype="float64", **(STATED | labels)))


@pytest.fixture
def maps(tmp_path):
    """A file of Q and U with a complete header."""
    return write_stokes(tmp_path / "maps.fits", *stokes())


@pytest.fixture
def out(tmp_path):
    """A directory that is not there yet."""
    return tmp_path / "new" / "out"


def run(*arguments, out, pictures=False):
    """Run a command; return exit status, stdout and stderr. The method is one that is quick."""
    if arguments[0] == "separate" and "--method" not in arguments:
        arguments = (*arguments, "--method", "pseudo")
    shown = ["--output", str(out), "--pictures" if pictures else "--no-pictures"]
    result = CliRunner().invoke(main, [*map(str, arguments), *shown], catch_exceptions=False)
    return result.exit_code, result.stdout, result.stderr


def run_well(*arguments, out, pictures=False):
    """Run a command that must succeed; return its stdout."""
    status, stdout, stderr = run(*arguments, out=out, pictures=pictures)
    assert status == 0, stderr
    return stdout


def refusal(*arguments, out):
    """Run a command that must be refused; return the one sentence it says."""
    status, stdout, stderr = run(*arguments, out=out)
    assert (status, stdout) == (1, "")
    assert not out.exists()
    (sentence,) = [line for line in stderr.splitlines() if line.startswith("Error: ")]
    assert stderr.endswith(f"{sentence}\n")
    return sentence


def eb_maps(out):
    return [read_map(out / "eb.fits", column=name).values for name in "EB"]


def weights(out, column="WEIGHT"):
    return read_map(out / "weights.fits", column=column).values


# What may be asked


@pytest.mark.parametrize("command", ["separate", "demo", "info", "warmup"])
def test_help_is_given_before_anything_heavy_is_loaded(command):
    script = (
        "import sys; from spinsdw.cli import main; "
        f"main([{command!r}, '--help'], standalone_mode=False); print(*sys.modules)"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60
    )
    *shown, modules = result.stdout.splitlines()
    assert shown[0].startswith("Usage")
    assert not HEAVY.intersection(modules.split())


def test_choices_are_those_of_the_separator():
    assert set(METHODS) == set(registry.METHODS)
    assert get_args(Output) == OUTPUTS


def test_defaults_are_those_of_the_separator():
    parameters = inspect.signature(EBSeparator).parameters
    options = {option.name: option for option in separate.params}
    names = ("bandlimit", "method", "directions", "dilation", "lowest_scale", "output")
    values = {name: options[name].get_default(click.Context(separate)) for name in names}
    # click has an object of its own for "none".
    given = {
        name: value if isinstance(value, (float, str)) or type(value) is int else None
        for name, value in values.items()
    }
    assert given == {name: parameters[name].default for name in names}


def test_version_is_told():
    result = CliRunner().invoke(main, ["--version"])
    assert result.exit_code == 0
    assert "spinsdw, version " in result.output


# What is computed


def test_separation_of_the_full_sky_returns_e_and_b(maps, out):
    """E = sum E_lm Ylm, B = sum B_lm Ylm of P = sum -(E_lm + i B_lm) 2Ylm."""
    run_well("separate", maps, out=out)
    for found, flm in zip(eb_maps(out), coefficients(), strict=True):
        assert_close(found, flm_to_map(flm, NSIDE, real=True), ulps=1.1 * FLOAT32_ULPS)
    assert_close(weights(out), np.ones(NPIX), ulps=0)


def test_derivatives_are_e_and_b_times_n_l(maps, out):
    """N_l = sqrt((l + 2)! / (l - 2)!)."""
    run_well("separate", maps, "--output-kind", "derivatives", out=out)
    for found, flm in zip(eb_maps(out), coefficients(), strict=True):
        raised = multiply_by_degree(flm, polarisation_factor(BANDLIMIT))
        assert_close(found, flm_to_map(raised, NSIDE, real=True), ulps=1.1 * FLOAT32_ULPS)


def test_command_writes_what_the_separator_returns(maps, out):
    cut = (
        "--galactic-cut",
        "20",
        "--directions",
        "2",
        "--largest-share",
        "0.4",
        "--lowest-scale",
        "1",
    )
    run_well("separate", maps, *cut, "--coefficients", out=out)
    mask = galactic_cut(NSIDE, np.radians(20))
    separator = EBSeparator(mask=mask, directions=2, method=Pseudo(0.4), lowest_scale=1)
    found = separator.separate(*stokes())
    observed = mask > 0
    for written, values in zip(eb_maps(out), (found.E, found.B), strict=True):
        assert_close(written[observed], values[observed], ulps=FLOAT32_ULPS)
    assert_close(weights(out), found.weight, ulps=FLOAT32_ULPS)
    assert_close(weights(out, "WEIGHT_2"), found.weights[2], ulps=FLOAT32_ULPS)
    kept = read_coefficients(out / "wavelet_coefficients.fits")
    assert (kept - found.coefficients).norm() == 0


def test_file_in_iau_and_nested_gives_what_one_in_cosmo_and_ring_gives(maps, tmp_path, out):
    q, u = stokes()
    iau = write_stokes(tmp_path / "iau.fits", q, -u, polconv="IAU", ordering="NESTED")
    run_well("separate", maps, out=out)
    run_well("separate", iau, out=tmp_path / "iau")
    assert np.array_equal(eb_maps(out), eb_maps(tmp_path / "iau"))


def test_two_files_give_what_one_file_gives(maps, tmp_path, out):
    pair = [
        str(write_maps(tmp_path / f"{name}.fits", {"BEST": values}, dtype="float64", **STATED))
        for name, values in zip("qu", stokes(), strict=True)
    ]
    text = run_well("separate", *pair, "--columns", "best", out=out)
    run_well("separate", maps, out=tmp_path / "one")
    assert np.array_equal(eb_maps(out), eb_maps(tmp_path / "one"))
    assert "q.fits, column BEST" in text


@pytest.mark.parametrize("columns", ["G_X,G_Y", "0,1", " g_x , 1"])
def test_columns_go_by_name_and_by_number(columns, tmp_path, out):
    path = write_stokes(tmp_path / "shear.fits", *stokes(), names=("G_X", "G_Y"))
    assert "columns G_X and G_Y" in run_well("separate", path, "--columns", columns, out=out)


def test_output_in_nested_order_is_the_same_sky(maps, tmp_path, out):
    run_well("separate", maps, out=out)
    run_well("separate", maps, "--ordering-out", "NESTED", out=tmp_path / "nested")
    assert np.array_equal(eb_maps(out), eb_maps(tmp_path / "nested"))
    assert fits.getheader(tmp_path / "nested" / "eb.fits", 1)["ORDERING"] == "NESTED"


def test_result_does_not_depend_on_threads(maps, tmp_path, out):
    run_well("separate", maps, "--galactic-cut", "10", "--threads", "1", out=out)
    run_well("separate", maps, "--galactic-cut", "10", "--threads", "2", out=tmp_path / "two")
    assert np.array_equal(eb_maps(out), eb_maps(tmp_path / "two"))


# Masks and bad pixels


@pytest.mark.parametrize(
    ("nside", "told"),
    [
        (2, "upgraded from nside 2 to 4"),
        (4, "nside 4"),
        (8, "degraded from nside 8 to 4 (a pixel is kept if half of it was)"),
    ],
)
def test_mask_is_brought_to_the_size_of_the_maps(nside, told, maps, tmp_path, out):
    cut = galactic_cut(nside, np.radians(30))
    mask = write_maps(tmp_path / "mask.fits", {"M": cut}, unit="unknown", coordinates="G")
    text = run_well("separate", maps, "--mask", mask, out=out)
    assert f"mask.fits, {told}" in " ".join(text.split())
    assert set(weights(out, "MASK")) == {0.0, 1.0}


def test_apodised_mask_of_a_finer_grid_is_averaged(maps, tmp_path, out):
    fine = np.repeat([0.0, 0.25, 1.0], 4 * 64)
    mask = write_maps(tmp_path / "mask.fits", {"M": fine}, unit="unknown")
    assert "averaged from nside 8" in run_well("separate", maps, "--mask", mask, out=out)
    assert_close(weights(out, "MASK").mean(), fine.mean(), ulps=FLOAT32_ULPS)


def test_column_and_order_of_a_mask_may_be_told(maps, tmp_path, out):
    path = tmp_path / "mask.fits"
    columns = {"T": np.ones(NPIX), "P": galactic_cut(NSIDE, 0.5)}
    write_maps(path, columns, unit="unknown")
    with fits.open(path, mode="update") as hdus:
        del hdus[1].header["ORDERING"]
    told = ("--mask-column", "P", "--mask-ordering", "RING")
    run_well("separate", maps, "--mask", path, *told, out=out)
    assert np.array_equal(weights(out, "MASK"), columns["P"])


def test_holes_of_a_mask_are_filled_up_to_an_area(maps, tmp_path, out):
    holed = galactic_cut(NSIDE, np.radians(20))
    holed[0] = 0
    mask = write_maps(tmp_path / "mask.fits", {"M": holed}, unit="unknown")
    area = 1.5 * np.degrees(np.degrees(4 * np.pi / NPIX))
    told = run_well("separate", maps, "--mask", mask, "--fill-holes", f"{area:.4f}", out=out)
    assert "holes up to" in told
    kept = sky_fraction(galactic_cut(NSIDE, np.radians(20)))
    assert f"{kept:.1%} observed" in told


def test_unseen_pixels_are_masked_counted_and_unseen_in_the_result(tmp_path, out):
    q, u = stokes()
    q[[3, 5]], u[[5, 100]] = UNSEEN, UNSEEN
    text = run_well("separate", write_stokes(tmp_path / "maps.fits", q, u), out=out)
    assert "3 pixels of the maps hold no measurement and were masked" in text
    assert np.flatnonzero(weights(out, "MASK") == 0).tolist() == [3, 5, 100]
    for values in eb_maps(out):
        assert np.flatnonzero(np.isclose(values, UNSEEN)).tolist() == [3, 5, 100]


def test_nan_is_refused_unless_it_may_be_masked(tmp_path, out):
    q, u = stokes()
    q[7] = np.nan
    path = write_stokes(tmp_path / "maps.fits", q, u)
    assert "pass --bad-pixels 'mask'" in refusal("separate", path, out=out)
    assert "1 pixels" in run_well("separate", path, "--bad-pixels", "mask", out=out)


@pytest.mark.parametrize("frame", ["C", "unknown"])
def test_galactic_cut_needs_galactic_maps(frame, tmp_path, out):
    path = write_stokes(tmp_path / "maps.fits", *stokes(), coordinates=frame)
    assert "--galactic-cut 20.0 needs" in refusal("separate", path, "--galactic-cut", "20", out=out)


def test_mask_in_other_coordinates_is_refused(maps, tmp_path, out):
    mask = write_maps(tmp_path / "mask.fits", {"M": np.ones(NPIX)}, unit="unknown", coordinates="C")
    assert "rotate the mask" in refusal("separate", maps, "--mask", mask, out=out)


# What is written


def test_files_say_what_they_are(maps, out):
    run_well("separate", maps, "--galactic-cut", "20", out=out)
    header = fits.getheader(out / "eb.fits", 1)
    found = {key: header[key] for key in ("ORDERING", "COORDSYS", "POLCCONV", "TUNIT1", "TTYPE2")}
    assert found == dict(zip(found, ("RING", "G", "COSMO", "uK", "B"), strict=True))
    history = " ".join(header["HISTORY"])
    for fact in (
        "maps.fits, columns Q_STOKES and U_STOKES",
        "below 20 degrees",
        "largest_share=0.2",
    ):
        assert fact in history
    assert "TUNIT1" not in fits.getheader(out / "weights.fits", 1)


def test_folders_of_the_user_do_not_get_into_files(maps, tmp_path, out):
    text = run_well("separate", maps, out=out)
    assert str(tmp_path) not in text.replace(str(out), "")
    assert str(tmp_path).encode() not in (out / "eb.fits").read_bytes()


def test_summary_is_printed_and_written(maps, out):
    text = run_well("separate", maps, out=out)
    assert (out / "summary.txt").read_text() == text
    for name in ("Q, U", "maps", "mask", "degrees", "fit", "rms", "kept", "seconds", "written"):
        assert f"\n{name} " in text
    assert max(map(len, text.splitlines())) <= 88 + len(str(out))


def test_no_scale_is_kept_on_more_than_the_observed_sky(maps, out):
    text = run_well("separate", maps, "--galactic-cut", "20", "--largest-share", "0.9", out=out)
    observed = float(re.search(r"sky +([\d.]+)% observed", text)[1])
    kept = [float(share) for share in re.findall(r"([\d.]+)%  scale", text)]
    assert len(kept) == 2
    assert 0 < max(kept) <= observed


def test_only_the_files_told_are_written(maps, out):
    told = run_well("separate", maps, out=out).partition(f"{out}:")[2]
    assert {path.name for path in out.iterdir()} == set(told.replace(",", "").split())


def test_pictures_are_drawn(maps, out):
    run_well("separate", maps, "--galactic-cut", "20", out=out, pictures=True)
    for name in PICTURES:
        assert (out / name).read_bytes().startswith(b"\x89PNG")


def test_pictures_of_a_sky_without_a_good_pixel_are_drawn(maps, out):
    cut = ("--galactic-cut", "70", "--bandlimit", "4")
    text = run_well("separate", maps, *cut, out=out, pictures=True)
    assert "no pixel has a weight above 0.5" in text
    assert (out / "b_scales.png").is_file()


def test_without_matplotlib_pictures_are_refused_before_any_work(monkeypatch, out):
    monkeypatch.setattr("spinsdw.cli.pictures.find_spec", lambda _: None)
    status, _, stderr = run("separate", "nowhere.fits", out=out, pictures=True)
    assert status == 1
    assert "pip install 'spinsdw[plot]' or give --no-pictures" in stderr


def test_output_that_exists_is_refused_before_the_input_is_read(maps, out):
    run_well("separate", maps, out=out)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    status, _, stderr = run("separate", "nowhere.fits", out=out)
    assert status == 1
    assert "holds eb.fits, weights.fits, summary.txt already" in stderr
    assert stderr.rstrip().endswith("or --overwrite.")
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_overwriting_tells_what_is_left_from_an_earlier_run(maps, out):
    run_well("separate", maps, "--coefficients", out=out)
    text = run_well("separate", maps, "--overwrite", out=out)
    assert "wavelet_coefficients.fits is left from an earlier run" in text


def test_failure_to_write_leaves_nothing_new(maps, out, monkeypatch):
    def fail(folder, *_):
        (folder / "eb.fits").write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device", "eb.fits")

    monkeypatch.setattr("spinsdw.cli.separation.write_files", fail)
    assert "No space left on device: 'eb.fits'" in refusal("separate", maps, out=out)
    assert not out.parent.exists()


def test_failure_to_write_leaves_the_older_output(maps, out, monkeypatch):
    run_well("separate", maps, out=out)
    before = {path.name: path.read_bytes() for path in out.iterdir()}

    def fail(*_):
        raise MemoryError

    monkeypatch.setattr("spinsdw.cli.separation.write_files", fail)
    status, _, stderr = run("separate", maps, "--overwrite", out=out)
    assert status == 1
    assert "lower --bandlimit" in stderr
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_output_below_a_file_is_refused(maps, tmp_path):
    (tmp_path / "file").touch()
    status, _, stderr = run("separate", maps, out=tmp_path / "file" / "out")
    assert status == 1
    assert "is a file" in stderr


def test_output_that_may_not_be_written_is_refused(maps, out, monkeypatch):
    monkeypatch.setattr("os.access", lambda *_: False)
    assert "is not writable" in refusal("separate", maps, out=out)


def test_output_named_as_a_directory_is_refused(maps, out):
    (out / "eb.fits").mkdir(parents=True)
    status, _, stderr = run("separate", maps, "--overwrite", out=out)
    assert status == 1
    assert "directories named as outputs" in stderr


# What is refused


def test_what_a_header_lacks_is_asked_for_by_its_option(tmp_path, out):
    path = tmp_path / "maps.fits"
    names = {"A": stokes()[0], "B": stokes()[1]}
    write_maps(path, names, unit="uK", dtype="float64")
    told = refusal("separate", path, "--columns", "A,B", out=out)
    assert told.endswith("give --polconv 'COSMO' or --polconv 'IAU'.")
    run_well("separate", path, "--columns", "A,B", "--polconv", "COSMO", out=out)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--columns", "Q_STOKES,nope"], "has no column 'nope'"),
        (["--columns", "7,8"], "has no column 7"),
        (["--columns", "1,1"], "are one column 'U_STOKES'"),
        (["--columns", "Q_STOKES"], "must be the two columns"),
        (["--polconv", "IAU"], "against --polconv 'IAU'"),
        (["--ordering", "NESTED"], "against --ordering 'NESTED'"),
        (["--max-memory", "100"], "--max-memory 100 bytes is less"),
        (["--bandlimit", "13"], "--bandlimit 13 must not exceed"),
        (["--directions", "0"], "--directions 0 "),
        (["--dilation", "1"], "--dilation 1.0 "),
        (["--lowest-scale", "9"], "--lowest-scale 9 "),
        (["--largest-share", "0"], "--largest-share 0.0 "),
        (["--mask", "nowhere.fits"], "path='nowhere.fits' does not exist"),
    ],
)
def test_refusal_names_the_option(options, told, maps, out):
    assert told in refusal("separate", maps, *options, out=out)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--columns", "a,b,c"], "one column, or two"),
        (["--columns", "a,"], "one column, or two"),
        (["--mask-column", "1,2"], "must be one column"),
        (["--mask", "m.fits", "--galactic-cut", "20"], "cannot both be given"),
        (["--fill-holes", "3"], "give one with --mask"),
        (["--galactic-cut", "90"], "--galactic-cut"),
        (["--unit", "µK"], "printable ASCII"),
        (["--method", "magic"], "--method"),
        (["--threads", "0"], "--threads"),
    ],
)
def test_misuse_ends_with_status_two(options, told, maps, out):
    status, stdout, stderr = run("separate", maps, *options, out=out)
    assert (status, stdout) == (2, "")
    assert told in stderr
    assert not out.exists()


def test_file_that_is_no_fits_file_is_refused(tmp_path, out):
    path = tmp_path / "notes.txt"
    path.write_text("E and B")
    assert "is not a FITS file" in refusal("separate", path, out=out)


def test_truncated_file_is_refused(maps, tmp_path, out):
    path = tmp_path / "cut.fits"
    with open(maps, "rb") as whole:
        path.write_bytes(whole.read()[:-2880])
    assert "cut.fits" in refusal("separate", path, out=out)


def test_url_is_refused(out):
    assert "not a URL" in refusal("separate", "https://example.org/maps.fits", out=out)


def test_control_characters_of_a_name_do_not_reach_the_terminal(tmp_path, out):
    path = write_stokes(tmp_path / "a\x1b[2Jb.fits", *stokes())
    assert "\x1b" not in run_well("separate", path, out=out)
    status, _, stderr = run("separate", tmp_path / "\x1b[2J.fits", out=tmp_path / "other")
    assert status == 1
    assert "\x1b" not in stderr


@pytest.mark.filterwarnings("default")
def test_warnings_stand_in_the_summary(maps, out):
    text = run_well("separate", maps, "--bandlimit", "12", out=out)
    assert "above 2.5 nside + 1, where a fit is poor" in " ".join(text.split())


@pytest.mark.filterwarnings("default")
def test_warnings_of_others_are_shown_as_ever(maps, out, monkeypatch):
    def warn(*_, **__):
        warnings.warn("old format", DeprecationWarning, stacklevel=1)

    monkeypatch.setattr("spinsdw.cli.separation.write_files", warn)
    monkeypatch.setattr("spinsdw.cli.outputs.file_names", lambda _: ["summary.txt"])
    with pytest.warns(DeprecationWarning, match="old format"):
        run_well("separate", maps, out=out)


def test_closed_pipe_ends_quietly(maps, out, monkeypatch):
    def close(_):
        raise BrokenPipeError(errno.EPIPE, "Broken pipe")

    monkeypatch.setattr("spinsdw.cli.separation.run_separation", close)
    status, _, stderr = run("separate", maps, out=out)
    assert (status, stderr) == (1, "")


# The other commands


def test_demo_says_that_it_shows_a_foreground(tmp_path, out, monkeypatch):
    pair = [
        write_maps(
            tmp_path / f"{name}.fits", {"BESTFIT": values}, unit="unknown", ordering="NESTED"
        )
        for name, values in zip("qu", stokes(), strict=True)
    ]
    monkeypatch.setattr("spinsdw.datasets.wmap_synchrotron_paths", lambda: tuple(pair))
    mask = write_maps(tmp_path / "mask.fits", {"M": galactic_cut(2, 0.3)}, unit="unknown")
    monkeypatch.setattr("spinsdw.datasets.wmap_mask_path", lambda: mask)
    text = run_well("demo", out=out, pictures=True)
    assert "foreground, not the CMB" in text
    assert "upgraded from nside 2" in text
    header = fits.getheader(out / "eb.fits", 1)
    assert "foreground, not the CMB" in " ".join(header["HISTORY"])
    assert (header["TUNIT1"], header["COORDSYS"]) == ("mK_RJ", "G")


@pytest.mark.slow
def test_demo_does_what_separate_does_with_the_bundled_files(tmp_path, out):
    from spinsdw.datasets import wmap_mask_path, wmap_synchrotron_paths

    run_well("demo", out=out, pictures=True)
    stated = ["--columns", "BESTFIT", "--polconv", "COSMO", "--unit", "mK_RJ"]
    files = (*wmap_synchrotron_paths(), "--mask", wmap_mask_path())
    holes = ("--fill-holes", "100")
    method = ("--method", "hybrid")
    run_well("separate", *files, *stated, *holes, *method, out=tmp_path / "again", pictures=True)
    assert np.array_equal(eb_maps(out), eb_maps(tmp_path / "again"))
    assert {path.name for path in out.iterdir()} >= set(PICTURES)


def test_info_tells_versions_and_machine():
    result = CliRunner().invoke(main, ["info"])
    assert result.exit_code == 0
    for name in ("spinsdw", "numba", "matplotlib", "python", "processor", "vectors", "cache"):
        assert f"\n{name} " in f"\n{result.stdout}"


def test_info_tells_what_is_not_installed(monkeypatch):
    monkeypatch.setattr("spinsdw.cli.environment.PACKAGES", ("no-such-package",))
    assert "not installed" in CliRunner().invoke(main, ["info"]).stdout


def test_info_tells_a_processor_where_linux_has_no_table(monkeypatch):
    monkeypatch.setattr("pathlib.Path.is_file", lambda _: False)
    assert describe()["processor"]


def test_warmup_tells_seconds(monkeypatch):
    monkeypatch.setattr("spinsdw.warmup.warm_up", lambda _: {"one": 1.0, "two": 2.0})
    result = CliRunner().invoke(main, ["warmup"])
    assert result.stdout.splitlines()[-1] == "    3.00 s  in all"


# Progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_progress_is_plain_lines_where_there_is_no_terminal():
    stream = io.StringIO()
    with progress(2, stream) as steps:
        with steps.step("reading"):
            pass
        with steps.step("writing", remark="once"):
            pass
    assert stream.getvalue() == "1/2 reading\n2/2 writing (once)\n"
    assert list(steps.seconds) == ["reading", "writing"]


def test_progress_is_a_bar_on_a_terminal(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal()
    with progress(1, stream) as steps, steps.step("reading [odd] names"):
        pass
    assert "reading [odd] names" in stream.getvalue()
    assert "1/1" not in stream.getvalue()


def test_compiling_is_a_step_of_the_first_run_alone(maps, tmp_path, out, monkeypatch):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "0")
    monkeypatch.setattr("spinsdw.cli.separation.warm_up", lambda _: {})
    monkeypatch.setattr("spinsdw.cli.separation.cache_directory", lambda: None)
    _, text, told = run("separate", maps, out=out)
    assert "2/4 compiling" in told
    assert "compiling 0.00" in text
    monkeypatch.setattr("spinsdw.cli.separation.cache_directory", lambda: tmp_path)
    assert "compiling" not in run("separate", maps, "--overwrite", out=out)[2]


def test_nothing_is_compiled_where_compilation_is_off(maps, out, monkeypatch):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    monkeypatch.setattr("spinsdw.cli.separation.cache_directory", lambda: None)
    assert "compiling" not in run("separate", maps, out=out)[2]
