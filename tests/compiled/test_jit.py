"""The cache of machine code: never in the way, whatever state its folder is in."""

from __future__ import annotations

import math
import os
import pickle
import shutil
from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
import pytest

from spinsdw.compiled import jit
from tests.helpers import needs_compiler

pytestmark = needs_compiler


def add_squares(values):
    total = 0.0
    for r in range(values.size):
        total += values[r] * values[r]
    return total


VALUES = np.arange(5.0)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty folder of its own as the cache."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("SPINSDW_CACHE", str(folder))
    return folder


def files(cache):
    return sorted(path for path in cache.rglob("*") if path.is_file())


def use():
    """Compile, or load, and call; return how often machine code was loaded."""
    function = jit.kernel(add_squares)
    assert function(VALUES) == 30.0
    return sum(function.stats.cache_hits.values())


def test_machine_code_is_kept_and_found_again(cache):
    assert use() == 0
    assert [path.suffix for path in files(cache)] == [".nbc", ".nbi"]
    assert use() == 1
    assert use() == 1


@pytest.mark.usefixtures("cache")
def test_kernels_of_one_name_do_not_share_machine_code():
    """The line is part of the key: a helper defined twice is two functions."""
    use()

    def add_squares(values):
        return values.size

    assert jit.kernel(add_squares)(VALUES) == 5
    assert use() == 1


@pytest.mark.parametrize(
    ("suffix", "content"),
    [
        (".nbi", b""),
        (".nbi", b"\0"),
        (".nbi", b"no pickle at all"),
        (".nbi", pickle.dumps("0.0.0")),
        (".nbi", pickle.dumps(numba.__version__)),
        (".nbi", pickle.dumps(3)),
        (".nbc", b""),
        (".nbc", b"\0"),
        (".nbc", b"no pickle at all"),
        (".nbc", pickle.dumps(None)),
        (".nbc", pickle.dumps(3)),
        (".nbc", pickle.dumps((1, 2, 3))),
    ],
)
def test_a_file_that_is_no_cache_is_compiled_anew(cache, suffix, content):
    use()
    for path in files(cache):
        if path.suffix == suffix:
            path.write_bytes(content)
    use()
    assert use() == 1


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("share", [0.01, 0.5, 0.99])
def test_a_file_cut_short_is_compiled_anew(cache, suffix, share):
    """As a full disk or a killed process leaves it."""
    use()
    for path in files(cache):
        if path.suffix == suffix:
            content = path.read_bytes()
            path.write_bytes(content[: int(share * len(content))])
    use()
    assert use() == 1


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("share", [0.0, 0.003, 0.3, 0.7, 0.999])
def test_a_changed_bit_is_noticed(cache, suffix, share):
    """Machine code with a bit changed crashed the process."""
    use()
    for path in files(cache):
        if path.suffix == suffix:
            content = bytearray(path.read_bytes())
            content[int(share * len(content))] ^= 16
            path.write_bytes(content)
    assert use() == 0
    assert use() == 1


@pytest.mark.usefixtures("cache")
@pytest.mark.parametrize("content", [3, None, (1, 2), "text"])
def test_a_whole_file_of_the_wrong_kind_is_compiled_anew(content):
    """Its digest is right: it was unpickled and rebuilding raised a TypeError."""
    use()
    entry = jit.kernel(add_squares)._cache._cache_file
    (name,) = entry._load_index().values()
    entry._save_data(name, content)
    assert use() == 0
    assert use() == 1


def test_a_file_that_is_gone_is_compiled_anew(cache):
    use()
    for path in files(cache):
        if path.suffix == ".nbc":
            path.unlink()
    use()
    assert use() == 1


def test_a_folder_that_is_gone_does_not_matter(cache):
    use()
    function = jit.kernel(add_squares)
    shutil.rmtree(cache)
    assert function(VALUES) == 30.0


def test_a_folder_in_place_of_a_file_does_not_matter(cache):
    use()
    for path in files(cache):
        path.unlink()
        path.mkdir()
    use()


@pytest.mark.usefixtures("cache")
def test_machine_code_of_other_sources_is_not_used(monkeypatch):
    """A change in one file of the folder may be inlined in a function of another."""
    use()
    monkeypatch.setattr(jit, "_source_stamp", lambda: "another")
    assert use() == 0
    assert use() == 1


def test_width_of_vectors_is_part_of_the_stamp(monkeypatch):
    stamps = set()
    for width in ("2", "4", "8"):
        monkeypatch.setenv("SPINSDW_VECTOR_WIDTH", width)
        stamps.add(jit._source_stamp.__wrapped__())
    assert len(stamps) == 3


def test_widths_of_vectors_do_not_share_a_folder(cache, monkeypatch):
    """They wrote the same files, each in place of the other's."""
    folders = set()
    for width in ("2", "4", "8", ""):
        monkeypatch.setenv("SPINSDW_VECTOR_WIDTH", width)
        folders.add(jit.cache_directory())
    assert len(folders) == 4
    monkeypatch.setenv("SPINSDW_VECTOR_WIDTH", "../elsewhere")
    assert jit.cache_directory() in folders
    assert all(folder.parent == cache for folder in folders)


def test_versions_of_the_sources_do_not_share_a_folder(cache, monkeypatch):
    use()
    monkeypatch.setattr(jit, "_source_stamp", lambda: "another")
    use()
    monkeypatch.undo()
    monkeypatch.setenv("SPINSDW_CACHE", str(cache))
    assert use() == 1


def test_zero_switches_the_cache_off(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SPINSDW_CACHE", "0")
    assert jit.cache_directory() is None
    assert use() == 0
    assert use() == 0
    assert not files(tmp_path)


def test_folder_is_named_after_numba_and_python(cache):
    folder = jit.cache_directory()
    assert folder.parent == cache
    assert folder.name.startswith(f"numba-{numba.__version__}-python-3")
    assert folder.is_dir()


def test_folder_is_the_users_own_by_default(tmp_path, monkeypatch):
    monkeypatch.delenv("SPINSDW_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert jit.cache_directory().parent == tmp_path / "xdg" / "spinsdw"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert jit.cache_directory().parent == tmp_path / "home" / ".cache" / "spinsdw"


def test_no_folder_can_be_made_below_a_file(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SPINSDW_CACHE", str(tmp_path / "file" / "cache"))
    assert jit.cache_directory() is None
    assert use() == 0


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="needs modes of files")
@pytest.mark.parametrize("mode", [0o720, 0o702, 0o777])
def test_a_folder_that_others_may_write_to_is_refused(cache, mode):
    """Machine code from it would run as the user."""
    jit.cache_directory().chmod(mode)
    assert jit.cache_directory() is None
    assert use() == 0
    assert not files(cache)


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="needs owners of files")
def test_a_folder_of_another_user_is_refused(cache, monkeypatch):
    assert jit.cache_directory() is not None
    mine = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: mine + 1)
    assert jit.cache_directory() is None
    assert not files(cache)


@pytest.mark.usefixtures("cache")
def test_a_folder_that_may_only_be_read_is_not_used(monkeypatch):
    """Asked of the system, not read from the mode: root may write anywhere."""
    jit.cache_directory()
    monkeypatch.setattr(os, "access", lambda *_, **__: False)
    assert jit.cache_directory() is None
    assert use() == 0


@pytest.mark.usefixtures("cache")
@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() == 0, reason="root writes anywhere")
def test_a_folder_that_became_read_only_does_not_matter():
    function = jit.kernel(add_squares)
    folder = jit.cache_directory()
    folder.chmod(0o500)
    assert function(VALUES) == 30.0
    folder.chmod(0o700)


@pytest.mark.usefixtures("cache")
def test_several_threads_may_compile_at_once():
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: use(), range(8)))
    assert use() == 1


def test_kernels_divide_as_numpy_does():
    """No ZeroDivisionError inside a loop: 1 / 0 is infinite."""

    @jit.kernel
    def divide(x, y):
        return x / y

    assert divide(1.0, 0.0) == math.inf


def test_kernels_hand_nan_and_infinity_on():
    """Fast arithmetic must not turn a NaN of a map into a number."""

    @jit.kernel
    def add(values):
        total = 0.0
        for r in range(values.size):
            total += values[r]
        return total

    assert math.isnan(add(np.array([1.0, math.nan, 2.0, 3.0])))
    assert add(np.array([1.0, math.inf, 2.0, 3.0])) == math.inf
    assert math.isnan(add(np.array([-math.inf, math.inf, 2.0, 3.0])))


def test_kernels_let_go_of_the_interpreter():
    assert jit.kernel(add_squares).targetoptions["nogil"]
