"""What a wavelet transform is told: its tiling and directionality, and the text that names one."""

from __future__ import annotations

import hashlib
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from spinsdw.directionality import Directionality, SteerableDirectionality
from spinsdw.errors import ParameterError
from spinsdw.tiling import ScaleDiscretisedTiling, Tiling

__all__ = ["resolve_directionality", "resolve_tiling", "tiling_text"]

Array = np.ndarray[Any, Any]


def resolve_tiling(
    tiling: Tiling | None, bandlimit: int, dilation: float | None, lowest_scale: int | None
) -> Tiling:
    """Return a transform's tiling, or say what is wrong with it."""
    if tiling is None:
        return ScaleDiscretisedTiling(
            bandlimit,
            dilation=2.0 if dilation is None else dilation,
            lowest_scale=0 if lowest_scale is None else lowest_scale,
        )
    if not isinstance(tiling, Tiling):
        msg = f"tiling={tiling!r} must be a Tiling, such as ScaleDiscretisedTiling({bandlimit})."
        raise ParameterError(msg)
    for name, value in (("dilation", dilation), ("lowest_scale", lowest_scale)):
        if value is not None:
            msg = f"{name}={value!r} cannot be given with a tiling, which has its own; drop one."
            raise ParameterError(msg)
    if tiling.bandlimit != bandlimit:
        msg = (
            f"tiling has bandlimit {tiling.bandlimit} but the transform has {bandlimit}; "
            "make the tiling with the transform's bandlimit."
        )
        raise ParameterError(msg)
    return tiling


def resolve_directionality(
    directionality: Directionality | None, directions: int | None
) -> Directionality:
    """Return a transform's directionality, or say what is wrong with it."""
    if directionality is None:
        return SteerableDirectionality(1 if directions is None else directions)
    if directions is not None:
        msg = (
            f"directions={directions!r} cannot be given with a directionality, which has its own; "
            "drop one."
        )
        raise ParameterError(msg)
    return directionality


def _digest(*arrays: Array) -> str:
    content = b"".join(np.ascontiguousarray(values).tobytes() for values in arrays)
    return f"sha256:{hashlib.sha256(content).hexdigest()[:16]}"


def tiling_text(tiling: Tiling) -> str:
    """Name a tiling and its parameters in one line of text, an array by a digest of its values."""
    name = type(tiling).__name__
    if not is_dataclass(tiling):
        kernels = (tiling.kernel(j) for j in tiling.scales)
        return f"{name}({_digest(tiling.scaling_kernel, *kernels)})"
    values = {item.name: getattr(tiling, item.name) for item in fields(tiling)}
    texts = (
        f"{key}={_digest(value) if isinstance(value, np.ndarray) else repr(value)}"
        for key, value in values.items()
    )
    return f"{name}({', '.join(texts)})"
