"""Only local plain files are read, and an output is whole or absent."""

from __future__ import annotations

import os
import pathlib

import pytest

from spinsdw.errors import FileFormatError, OutputExistsError, ParameterError
from spinsdw.files import atomic_directory, atomic_output, input_path, output_path


@pytest.mark.parametrize(
    "url", ["http://a.b/map.fits", "https://a.b/map.fits", "ftp://a.b/m", "s3://b/m", "file:///etc"]
)
def test_url_is_refused_for_input_and_output(url):
    for check in (input_path, output_path):
        with pytest.raises(ParameterError, match="must be a local file, not a URL; download it"):
            check(url)


@pytest.mark.parametrize("path", [b"map.fits", 3, None, "", "a\0b"])
def test_what_names_no_file_is_refused(path):
    with pytest.raises(ParameterError, match="path="):
        input_path(path)


def test_input_must_be_an_existing_plain_file(tmp_path):
    with pytest.raises(FileFormatError, match="does not exist; give the name"):
        input_path(tmp_path / "absent.fits")
    with pytest.raises(FileFormatError, match="is not a plain file; give the name"):
        input_path(tmp_path)


def test_output_needs_an_existing_directory_and_is_not_one(tmp_path):
    with pytest.raises(ParameterError, match="must lie in an existing directory; make"):
        output_path(tmp_path / "absent" / "map.fits")
    with pytest.raises(ParameterError, match="is a directory; give the name of a file in it"):
        output_path(tmp_path, overwrite=True)


def test_existing_output_stays_unless_overwriting_is_asked(tmp_path):
    path = tmp_path / "out"
    path.write_bytes(b"old")
    with pytest.raises(OutputExistsError, match="exists already"), atomic_output(path):
        pass
    assert path.read_bytes() == b"old"
    with atomic_output(path, overwrite=True) as stream:
        stream.write(b"new")
    assert path.read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["out"]


def test_output_that_fails_leaves_no_trace(tmp_path):
    path = tmp_path / "out"
    path.write_bytes(b"old")

    def write_half():
        with atomic_output(path, overwrite=True) as stream:
            stream.write(b"half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_half()
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["out"]


def test_output_appears_only_when_complete(tmp_path):
    path = tmp_path / "out"
    with atomic_output(path) as stream:
        stream.write(b"all of it")
        assert not path.exists()
    assert path.read_bytes() == b"all of it"


def test_output_that_appeared_meanwhile_is_kept(tmp_path):
    path = tmp_path / "out"

    def write_late():
        with atomic_output(path) as stream:
            stream.write(b"mine")
            path.write_bytes(b"theirs")

    with pytest.raises(OutputExistsError):
        write_late()
    assert path.read_bytes() == b"theirs"


def test_link_is_replaced_and_never_followed(tmp_path):
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_bytes(b"precious")
    link.symlink_to(target)
    with atomic_output(link, overwrite=True) as stream:
        stream.write(b"new")
    assert target.read_bytes() == b"precious"
    assert link.read_bytes() == b"new"
    assert not link.is_symlink()


def test_output_has_the_permissions_of_any_new_file(tmp_path):
    plain = tmp_path / "plain"
    plain.touch()
    with atomic_output(tmp_path / "out") as stream:
        stream.write(b"x")
    assert (tmp_path / "out").stat().st_mode == plain.stat().st_mode


def test_paths_may_be_texts_or_path_objects(tmp_path):
    (tmp_path / "a").touch()
    assert input_path(str(tmp_path / "a")) == input_path(pathlib.Path(tmp_path / "a"))


def fill(directory, text):
    (directory / "index").write_text(text)


def test_directory_is_whole_or_absent(tmp_path):
    path = tmp_path / "store"

    def write_half():
        with atomic_directory(path, "index", overwrite=True) as directory:
            fill(directory, "half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_half()
    assert not os.listdir(tmp_path)
    with atomic_directory(path, "index") as directory:
        fill(directory, "old")
    with pytest.raises(RuntimeError):
        write_half()
    assert (path / "index").read_text() == "old"
    assert os.listdir(tmp_path) == ["store"]


def test_directory_is_replaced_only_when_asked_and_when_it_has_the_marker(tmp_path):
    path = tmp_path / "store"
    with atomic_directory(path, "index") as directory:
        fill(directory, "old")
    with (
        pytest.raises(OutputExistsError, match="exists already"),
        atomic_directory(path, "index"),
    ):
        pass
    with (
        pytest.raises(ParameterError, match="holds no other and is not replaced"),
        atomic_directory(path, "other", overwrite=True),
    ):
        pass
    with atomic_directory(path, "index", overwrite=True) as directory:
        fill(directory, "new")
    assert (path / "index").read_text() == "new"
    assert os.listdir(tmp_path) == ["store"]


def test_older_directory_comes_back_when_the_name_cannot_be_taken(tmp_path, monkeypatch):
    path = tmp_path / "store"
    with atomic_directory(path, "index") as directory:
        fill(directory, "old")
    rename = pathlib.Path.rename

    def fail_for_the_new(place, target):
        if place.name.endswith(".part"):
            msg = "the name is taken"
            raise OSError(msg)
        return rename(place, target)

    monkeypatch.setattr(pathlib.Path, "rename", fail_for_the_new)
    with (
        pytest.raises(OSError, match="the name is taken"),
        atomic_directory(path, "index", overwrite=True) as directory,
    ):
        fill(directory, "new")
    assert (path / "index").read_text() == "old"
    assert os.listdir(tmp_path) == ["store"]
