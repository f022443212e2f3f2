"""The few lines that tell what a separation read, did and found."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from importlib import metadata
from typing import TYPE_CHECKING, Any

import numpy as np

from spinsdw.cli.outputs import file_names, left_behind
from spinsdw.cli.requests import SeparationRequest, shown
from spinsdw.maps_io.layout import UNKNOWN
from spinsdw.tiling import ScaleDiscretisedTiling

if TYPE_CHECKING:
    from spinsdw.cli.inputs import Inputs
    from spinsdw.polarisation import EBMaps

__all__ = ["TRUSTED", "part_degrees", "summarise"]

TRUSTED = 0.5
"""The weight above which a pixel counts as good."""

WIDTH, INDENT = 88, 12


def summarise(
    wanted: SeparationRequest,
    inputs: Inputs,
    maps: EBMaps,
    *,
    seconds: Mapping[str, float],
    warned: Sequence[str],
) -> str:
    """Return the summary of a separation.

    Parameters
    ----------
    wanted : SeparationRequest
        What was asked for.
    inputs : Inputs
        What was read.
    maps : EBMaps
        What was found.
    seconds : mapping of str to float
        Wall time of the steps of the job.
    warned : sequence of str
        Warnings raised on the way.

    Returns
    -------
    str
        Lines, the last one ended.
    """
    facts = [
        *inputs.facts.items(),
        ("degrees", _degrees(maps)),
        ("fit", _fit(maps)),
        ("rms", _rms(wanted, inputs, maps)),
        ("kept", _kept(maps)),
        ("seconds", _seconds(maps.info.seconds, seconds)),
        ("written", f"{shown(wanted.output.directory)}: {', '.join(file_names(wanted.output))}"),
        *(("note", f"{name} is left from an earlier run") for name in left_behind(wanted.output)),
        *(("warning", shown(text)) for text in warned),
    ]
    title = f"E and B by spin wavelets, spinsdw {metadata.version('spinsdw')}"
    lines = [title, *([wanted.remark] if wanted.remark else []), ""]
    lines += [line for name, fact in facts for line in _folded(name, fact)]
    return "\n".join(lines) + "\n"


def _folded(name: str, fact: str) -> list[str]:
    """Write a fact beside its name, over as many lines as it needs."""
    paragraphs = fact.split("\n")
    style: dict[str, Any] = {"break_long_words": False, "break_on_hyphens": False}
    lines = [line for text in paragraphs for line in textwrap.wrap(text, WIDTH - INDENT, **style)]
    return [f"{name if not i else '':{INDENT}}{line}".rstrip() for i, line in enumerate(lines)]


def part_degrees(key: int | str, parameters: Mapping[str, Any]) -> tuple[int, int]:
    """Return the lowest and the highest degree of a scale, or of the scaling part, for spin 2.

    The lowest exceeds the highest where there is none.
    """
    tiling = ScaleDiscretisedTiling(
        parameters["bandlimit"],
        dilation=parameters["dilation"],
        lowest_scale=parameters["lowest_scale"],
    )
    if key == "scaling":
        return 2, tiling.scaling_bandlimit - 1
    lowest = tiling.scale_lowest_degree(int(key))
    return max(2, lowest), tiling.scale_bandlimit(int(key)) - 1


def _degrees(maps: EBMaps) -> str:
    info, directions = maps.info, maps.coefficients.parameters["directions"]
    ways = f"{directions} direction{'s' if directions > 1 else ''}"
    scales = f"scales {info.scales[0]} to {info.scales[-1]}"
    return f"below {info.bandlimit}; {scales}, {ways}, method {info.method}"


def _fit(maps: EBMaps) -> str:
    fit, regularised = maps.info.fit, maps.info.convergence
    if regularised:
        return f"{regularised[0].iterations} iterations, residual {regularised[0].residual:.1e}"
    if fit is None:
        return "none"
    return (
        f"{fit.iterations} iterations, residual {fit.residual:.1e}; "
        f"{fit.map_residual:.1%} of the masked map is beyond these degrees"
    )


def _rms(wanted: SeparationRequest, inputs: Inputs, maps: EBMaps) -> str:
    trusted = maps.weight > TRUSTED
    if not trusted.any():
        return f"none: no pixel has a weight above {TRUSTED}"
    e, b = (f"{np.sqrt(np.mean(values[trusted] ** 2)):.4g}" for values in (maps.E, maps.B))
    unit = "" if inputs.maps.unit == UNKNOWN else f" {shown(inputs.maps.unit)}"
    output = wanted.settings.get("output", "fields")
    what = "" if output == "fields" else f" ({output})"
    where = f"where the weight is above {TRUSTED}, {trusted.mean():.1%} of the sky"
    return f"E {e}{unit}, B {b}{unit}{what} {where}"


def _kept(maps: EBMaps) -> str:
    return "\n".join(_kept_lines(maps))


def _kept_lines(maps: EBMaps) -> Iterator[str]:
    for key, kept in maps.info.kept_fraction.items():
        # Of the observed sky where there is a map of the weights: outside the mask it is zero.
        share = kept if isinstance(key, str) else float(np.mean(maps.weights[key]))
        low, high = part_degrees(key, maps.coefficients.parameters)
        name = "scaling" if isinstance(key, str) else f"scale {key}"
        degrees = f"degrees {low:4d} to {high:4d}" if low <= high else "no degrees"
        yield f"{share:6.1%}  {name:9} {degrees}"


def _seconds(inner: Mapping[str, float], outer: Mapping[str, float]) -> str:
    """Tell the steps of the job in order, those within the separation in place of itself."""
    told: dict[str, float] = {}
    for name, value in outer.items():
        told |= inner if name == "separating" else {name: value}
    return ", ".join(f"{name} {value:.2f}" for name, value in told.items())
