"""A Zarr store of arrays: one chunk for each signal and orientation, each with its checksum.

The group's attributes hold the parameters, as JSON text, and a digest of them and of every array's
shape and type. Chunks are plain numbers followed by their CRC-32C: a chunk's file has a known
length, so that nothing in it can ask for memory, and noise would not have compressed anyway. A
store is read only after its metadata were held against what `write_store` writes.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from spinsdw.errors import FileFormatError, MemoryBudgetError, MissingPackageError
from spinsdw.files import atomic_directory, local_path
from spinsdw.maps_io.guard import memory_budget, refuse
from spinsdw.maps_io.parameters import KEPT_DTYPES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["read_store", "write_store"]

FORMAT = "spinsdw wavelet coefficients 1"
LARGEST_CHUNK = 2**27  # bytes; a chunk is whole in memory while it is written or read
LARGEST_METADATA = 2**20
CHECKSUM = 4  # bytes of a CRC-32C
_REMEDY = "give a store that write_coefficients wrote"
_NAME = re.compile(r"SCALING|SCALE_\d+")


def _zarr() -> Any:
    try:
        import zarr
    except ImportError as error:
        msg = "zarr is not installed and must be for Zarr stores; pip install 'spinsdw[zarr]'."
        raise MissingPackageError(msg) from error
    return zarr


def _chunks(shape: tuple[int, ...], itemsize: int) -> tuple[int, ...]:
    """Return the shape of a chunk: one map, or as many of its rings as the largest chunk holds."""
    rings, points = (max(1, size) for size in shape[-2:])
    fitting = max(1, LARGEST_CHUNK // (points * itemsize))
    return (*(1 for _ in shape[:-2]), min(rings, fitting), points)


def _digest(parameters: str, arrays: Mapping[str, tuple[tuple[int, ...], str]]) -> str:
    """Return a digest of all that chunks do not say themselves."""
    text = json.dumps([parameters, {name: arrays[name] for name in sorted(arrays)}])
    return hashlib.sha256(text.encode()).hexdigest()


def write_store(
    path: str | os.PathLike[str],
    arrays: Mapping[str, NDArray[Any]],
    parameters: str,
    *,
    overwrite: bool,
) -> Path:
    """Write arrays and the text of their parameters, complete or not at all."""
    zarr = _zarr()
    kinds = {name: (values.shape, values.dtype.name) for name, values in arrays.items()}
    attributes = {
        "format": FORMAT,
        "parameters": parameters,
        "digest": _digest(parameters, kinds),
    }
    with (
        atomic_directory(path, "zarr.json", overwrite=overwrite) as directory,
        # A chunk of zeros is written too: one that is missing was lost.
        zarr.config.set({"array.write_empty_chunks": True}),
    ):
        store = zarr.storage.LocalStore(directory)
        group = zarr.create_group(store=store, zarr_format=3, attributes=attributes)
        for name, values in arrays.items():
            array = group.create_array(
                name,
                shape=values.shape,
                chunks=_chunks(values.shape, values.dtype.itemsize),
                dtype=values.dtype.newbyteorder("="),
                compressors=[zarr.codecs.Crc32cCodec()],
                fill_value=0,
            )
            for block, part in _blocks(array):
                array.blocks[block] = values[part]
    return local_path(path)


def _blocks(array: Any) -> Iterator[tuple[tuple[int, ...], tuple[slice, ...]]]:
    """Give the number of every chunk, and the part of the array that it holds."""
    counts = [-(-size // step) for size, step in zip(array.shape, array.chunks, strict=True)]
    for block in np.ndindex(*counts):
        starts = [i * step for i, step in zip(block, array.chunks, strict=True)]
        yield (
            block,
            tuple(slice(a, a + step) for a, step in zip(starts, array.chunks, strict=True)),
        )


def read_store(
    path: str | os.PathLike[str], max_memory: int | None
) -> tuple[str, dict[str, NDArray[Any]]]:
    """Return the text of the parameters and the arrays, or raise FileFormatError."""
    zarr = _zarr()
    root = local_path(path)
    if not (root / "zarr.json").is_file():
        found = "is no Zarr store" if root.exists() else "does not exist"
        raise refuse(root, found, _REMEDY)
    attributes = _metadata(root, root / "zarr.json", "group").get("attributes", {})
    if not isinstance(attributes, dict) or attributes.get("format") != FORMAT:
        raise refuse(root, f"is not marked as {FORMAT!r}", _REMEDY)
    kinds = {place.name: _kind(root, place) for place in sorted(root.iterdir()) if place.is_dir()}
    text = attributes.get("parameters")
    if not isinstance(text, str) or attributes.get("digest") != _digest(text, kinds):
        raise refuse(root, "does not have the digest of its metadata", _REMEDY)
    _check_memory(root, kinds, max_memory)
    # zarr raises any class on metadata that break its own rules.
    try:
        group = zarr.open_group(store=zarr.storage.LocalStore(root, read_only=True), mode="r")
        arrays = {name: group[name] for name in kinds}
    except Exception as error:
        found = f"cannot be read as Zarr ({type(error).__name__}: {str(error)[:200]!r})"
        raise refuse(root, found, _REMEDY) from error
    return text, {name: _array(root, array) for name, array in arrays.items()}


def _metadata(root: Path, file: Path, node: str) -> dict[str, Any]:
    """Return the JSON object of a zarr.json, which names a version 3 node of the kind wanted."""
    found: Any = None
    if file.is_file() and file.stat().st_size <= LARGEST_METADATA:
        try:
            found = json.loads(file.read_bytes())
        except (ValueError, RecursionError):
            found = None
    if not isinstance(found, dict) or (found.get("zarr_format"), found.get("node_type")) != (
        3,
        node,
    ):
        raise refuse(root, f"has no metadata of a Zarr {node} in {file.name!r}", _REMEDY)
    return found


def _kind(root: Path, place: Path) -> tuple[tuple[int, ...], str]:
    """Return shape and type of an array, after checking that it is laid out as ours are."""
    metadata = _metadata(root, place / "zarr.json", "array")
    shape: Any = metadata.get("shape")
    dtype: Any = metadata.get("data_type")
    is_shape = isinstance(shape, list) and all(type(n) is int and n >= 0 for n in shape)
    is_ours = is_shape and dtype in KEPT_DTYPES and _NAME.fullmatch(place.name)
    if not is_ours or len(shape) < 2:
        raise refuse(root, f"has no array of ours in {place.name!r}", _REMEDY)
    expected = {
        "chunk_grid": {
            "name": "regular",
            "configuration": {"chunk_shape": list(_chunks(shape, np.dtype(dtype).itemsize))},
        },
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "crc32c"}],
        "storage_transformers": [],
    }
    if any(metadata.get(name) != value for name, value in expected.items()):
        raise refuse(root, f"lays out {place.name!r} in another way than ours", _REMEDY)
    return tuple(shape), str(dtype)


def _check_memory(
    root: Path, kinds: Mapping[str, tuple[tuple[int, ...], str]], max_memory: int | None
) -> None:
    # An axis of length 0 does not excuse the others.
    needed = sum(
        math.prod(max(1, n) for n in shape) * np.dtype(dtype).itemsize
        for shape, dtype in kinds.values()
    )
    budget = memory_budget(max_memory)
    if needed + LARGEST_CHUNK > budget:
        msg = (
            f"max_memory={budget} bytes is less than the {needed + LARGEST_CHUNK} bytes that "
            f"reading {str(root)!r} takes; raise max_memory."
        )
        raise MemoryBudgetError(msg)


def _array(root: Path, array: Any) -> NDArray[Any]:
    expected = math.prod(array.chunks) * array.dtype.itemsize + CHECKSUM
    values = np.empty(array.shape, dtype=array.dtype)
    for block, part in _blocks(array):
        file = root.joinpath(array.basename, "c", *map(str, block))
        if file.is_symlink() or not file.is_file() or file.stat().st_size != expected:
            raise refuse(root, f"lacks the chunk {str(file.relative_to(root))!r}", _REMEDY)
        # One chunk at a time: an error then leaves no other read unfinished.
        try:
            values[part] = array.blocks[block]
        except (ValueError, OSError) as error:
            raise _damaged(root, file, error) from error
    return values


def _damaged(root: Path, file: Path, error: Exception) -> FileFormatError:
    found = f"has a damaged chunk {str(file.relative_to(root))!r} ({str(error)[:100]!r})"
    return refuse(root, found, "fetch the store again")
