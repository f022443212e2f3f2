"""The doors of the file system: which paths may be read, and outputs that are whole or absent."""

from __future__ import annotations

import os
import re
import secrets
import shutil
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING

from spinsdw.errors import FileFormatError, OutputExistsError, ParameterError

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["atomic_directory", "atomic_output", "input_path", "local_path", "output_path"]

_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:/+[^/]")


def local_path(path: str | os.PathLike[str]) -> Path:
    """Return a path that names something local, whether it is there or not, or raise."""
    if not isinstance(path, (str, os.PathLike)) or not isinstance(os.fspath(path), str):
        msg = f"path={path!r} must be a str or a pathlib.Path; give the name of a local file."
        raise ParameterError(msg)
    text = os.fspath(path)
    if _URL.match(text):
        msg = f"path={text!r} must be a local file, not a URL; download it first."
        raise ParameterError(msg)
    if not text or "\0" in text:
        msg = f"path={text!r} must name a file; give a name without null characters."
        raise ParameterError(msg)
    return Path(text)


def input_path(path: str | os.PathLike[str]) -> Path:
    """Check that a path names a local, plain, readable file.

    Parameters
    ----------
    path : str or path-like
        A local file. Names with a scheme, such as ``https://``, are refused.

    Returns
    -------
    Path
        The same path.

    Raises
    ------
    ParameterError
        `path` is not a path, is empty, or is a URL.
    FileFormatError
        There is no such file, or it is a directory or a device.

    Examples
    --------
    >>> from spinsdw.datasets import wmap_mask_path
    >>> input_path(wmap_mask_path()) == wmap_mask_path()
    True
    """
    local = local_path(path)
    if not local.is_file():
        found = "is not a plain file" if local.exists() else "does not exist"
        msg = f"path={str(local)!r} {found}; give the name of an existing file."
        raise FileFormatError(msg)
    return local


def output_path(path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Check that a file may be written at a path, before the work that makes its contents.

    Parameters
    ----------
    path : str or path-like
        A local file in an existing directory.
    overwrite : bool
        Allow a file to be there already.

    Returns
    -------
    Path
        The same path.

    Raises
    ------
    ParameterError
        `path` is not a path, is a URL, or its directory does not exist.
    OutputExistsError
        The file exists and `overwrite` is False.

    Examples
    --------
    >>> output_path("maps.fits").name
    'maps.fits'
    """
    local = local_path(path)
    if not local.parent.is_dir():
        msg = f"path={str(local)!r} must lie in an existing directory; make {str(local.parent)!r}."
        raise ParameterError(msg)
    if local.is_dir():
        msg = f"path={str(local)!r} is a directory; give the name of a file in it."
        raise ParameterError(msg)
    # lexists, so that a dangling link counts as there.
    if os.path.lexists(local) and not overwrite:
        msg = f"path={str(local)!r} exists already; give another name or overwrite=True."
        raise OutputExistsError(msg)
    return local


@contextmanager
def atomic_output(path: str | os.PathLike[str], *, overwrite: bool = False) -> Iterator[IO[bytes]]:
    """Open a file that appears under its name only when it is complete.

    The bytes go to a hidden file in the same directory, are flushed to disk, and take the name
    in one step. When the block raises, the hidden file goes and an older output stays untouched.
    A symbolic link under the name is replaced, never followed.

    Parameters
    ----------
    path : str or path-like
        A local file in an existing directory.
    overwrite : bool
        Replace a file that is there already.

    Yields
    ------
    binary file
        Open for writing.

    Raises
    ------
    ParameterError, OutputExistsError
        As `output_path`.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     target = Path(directory) / "notes.txt"
    ...     with atomic_output(target) as stream:
    ...         _ = stream.write(b"E and B")
    ...     target.read_bytes() == b"E and B"
    True
    """
    target = output_path(path, overwrite=overwrite)
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        # Mode "wb" is one that astropy knows; the opener adds the exclusiveness of "x".
        with open(partial, "wb", opener=_exclusive) as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        output_path(target, overwrite=overwrite)
        partial.replace(target)
        _flush(target.parent)
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def atomic_directory(
    path: str | os.PathLike[str], marker: str, *, overwrite: bool = False
) -> Iterator[Path]:
    """Make a directory that appears under its name only when it is complete.

    When the block raises, what it wrote goes and an older directory stays untouched. An older one
    is moved aside in one step and the new one takes the name in the next: between the two, and
    never at another time, the name is free.

    Parameters
    ----------
    path : str or path-like
        A local place in an existing directory.
    marker : str
        A file that the older directory must hold, so that no other can be replaced by mistake.
    overwrite : bool
        Replace a directory that is there already.

    Yields
    ------
    Path
        An empty directory to write into.

    Raises
    ------
    ParameterError
        `path` is not a path, is a URL, its parent does not exist, or what is there has no marker.
    OutputExistsError
        The name is taken and `overwrite` is False.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as parent:
    ...     with atomic_directory(f"{parent}/store", "index") as directory:
    ...         _ = (directory / "index").write_text("E and B")
    ...     (Path(parent) / "store" / "index").read_text()
    'E and B'
    """
    target = _directory_path(path, marker, overwrite=overwrite)
    token = secrets.token_hex(4)
    partial, older = (target.with_name(f".{target.name}.{token}.{end}") for end in ("part", "old"))
    partial.mkdir()
    try:
        yield partial
        for place in sorted(partial.rglob("*")):
            _flush(place)
        _flush(partial)
        _swap(partial, _directory_path(target, marker, overwrite=overwrite), older)
        _flush(target.parent)
    finally:
        for place in (partial, older):
            if place.exists():
                shutil.rmtree(place)


def _swap(new: Path, target: Path, older: Path) -> None:
    if target.exists():
        target.rename(older)
    try:
        new.rename(target)
    except OSError:
        if older.exists():
            older.rename(target)
        raise


def _directory_path(path: str | os.PathLike[str], marker: str, *, overwrite: bool) -> Path:
    local = local_path(path)
    if not local.is_dir():
        return output_path(local)
    if not overwrite:
        msg = f"path={str(local)!r} exists already; give another name or overwrite=True."
        raise OutputExistsError(msg)
    if local.is_symlink() or not (local / marker).is_file():
        msg = f"path={str(local)!r} holds no {marker} and is not replaced; give another name."
        raise ParameterError(msg)
    return local


def _exclusive(name: str, flags: int) -> int:
    return os.open(name, flags | os.O_EXCL, 0o666)


def _flush(place: Path) -> None:
    # A new name is on disk only when its directory is; Windows cannot open directories.
    if os.name == "posix":
        descriptor = os.open(place, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
