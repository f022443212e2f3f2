"""The parameters of wavelet coefficients as a line of JSON, and which arrays can be kept."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from spinsdw.errors import DataError, ParameterError
from spinsdw.maps_io.guard import refuse

if TYPE_CHECKING:
    from pathlib import Path

    from spinsdw.coefficients import WaveletCoefficients

__all__ = ["KEPT_DTYPES", "parameters_from_json", "parameters_to_json"]

KEPT_DTYPES = ("float32", "float64", "complex64", "complex128")
"""The types of arrays that come back as they were."""


def parameters_to_json(coefficients: WaveletCoefficients) -> str:
    """Return the parameters as JSON text, after checking that all arrays can be kept."""
    for key in ("scaling", *coefficients):
        values = coefficients.scaling if key == "scaling" else coefficients[int(key)]
        if values.dtype.name not in KEPT_DTYPES:
            name = "scaling part" if key == "scaling" else f"scale {key}"
            msg = f"{name} has dtype {values.dtype} but must have one of {', '.join(KEPT_DTYPES)}."
            raise DataError(msg)
    parameters = dict(coefficients.parameters)
    try:
        return json.dumps(parameters, allow_nan=False, default=_plain_number)
    except (TypeError, ValueError) as error:
        msg = f"parameters={parameters!r} must be numbers, texts or lists of them ({error})."
        raise ParameterError(msg) from error


def _plain_number(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    msg = f"{type(value).__name__} has no JSON form"
    raise TypeError(msg)


def parameters_from_json(path: Path, text: str) -> dict[str, Any]:
    """Return the parameters, or raise FileFormatError."""
    try:
        parameters = json.loads(text)
    except ValueError:
        parameters = None
    if not isinstance(parameters, dict):
        remedy = "give a file that write_coefficients wrote"
        raise refuse(path, "has no readable parameters", remedy)
    return parameters
