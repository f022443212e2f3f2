"""The doors of the file system: which paths may be read, and outputs that are whole or absent."""

from __future__ import annotations

import os
import re
import secrets
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING

from spinsdw.errors import FileFormatError, OutputExistsError, ParameterError

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["atomic_output", "input_path", "output_path"]

_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:/+[^/]")


def _local_path(path: str | os.PathLike[str]) -> Path:
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
    local = _local_path(path)
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
    local = _local_path(path)
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
        _flush_directory(target.parent)
    finally:
        partial.unlink(missing_ok=True)


def _exclusive(name: str, flags: int) -> int:
    return os.open(name, flags | os.O_EXCL, 0o666)


def _flush_directory(directory: Path) -> None:
    # The new name is on disk only when the directory is; Windows cannot open directories.
    if os.name == "posix":
        descriptor = os.open(directory, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
