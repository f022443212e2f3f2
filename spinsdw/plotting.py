"""Draw maps of the whole sky and tilings, without a display and without global state.

The functions that make figures build plain `matplotlib.figure.Figure` objects and never touch
pyplot; those that draw on axes take axes from anywhere, pyplot included.  East is to the left, as
on sky maps; the longitude zero is in the middle.  Hidden sky is light grey.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from spinsdw.errors import DataError, MissingPackageError, ParameterError, ShapeError
from spinsdw.files import atomic_output, output_path
from spinsdw.healpix import bad_pixel_mask
from spinsdw.maps_io import HealpixMap
from spinsdw.projections import Projection

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage
    from numpy.typing import ArrayLike, NDArray

    from spinsdw.tiling import Tiling

__all__ = [
    "figure_grid",
    "mollweide_figure",
    "plot_mollweide",
    "plot_projection",
    "plot_tiling",
    "save_figure",
    "tiling_figure",
]

Sky: TypeAlias = "HealpixMap | ArrayLike"
Limits: TypeAlias = tuple[float, float]

SIGNED_COLOURS = "RdBu_r"
UNSIGNED_COLOURS = "viridis"
HIDDEN_COLOUR = "#d4d4d4"
LINE_COLOUR = "#444444"
RASTER_ROWS = 600
ROBUST_PERCENTILE = 99.5


def plot_mollweide(  # noqa: PLR0913 - what a reader of a map has to be told
    axes: Axes,
    sky: Sky,
    *,
    title: str = "",
    unit: str | None = None,
    mask: ArrayLike | None = None,
    limits: Limits | None = None,
    colour_map: str | None = None,
) -> AxesImage:
    """Draw one map of the whole sky in the Mollweide projection, with its colour bar.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Ordinary axes, of pyplot or of a figure; their frame is taken away.
    sky : HealpixMap, or array_like, real
        A HEALPix map in RING order, shape (12 * nside**2,), or a map on an MW or MWSS grid,
        shape (rings, phi). Each point of the picture has the colour of the sample nearest to it.
    title : str
        Above the map.
    unit : str, optional
        Below the colour bar; by default that of `sky`.
    mask : array_like, same shape as the map, optional
        Where it is zero the sky is hidden. Bad pixels are hidden too.
    limits : pair of float, optional
        Values at the ends of the colour bar. By default, of what is visible: where it has both
        signs, plus and minus the 99.5th percentile of the moduli, so that zero is white; else the
        percentiles 0.5 and 99.5.
    colour_map : str, optional
        A colour map of matplotlib; by default "RdBu_r" where the limits have both signs, else
        "viridis".

    Returns
    -------
    matplotlib.image.AxesImage
        The picture.

    Raises
    ------
    MissingPackageError
        matplotlib is not installed.
    ShapeError
        The map is neither HEALPix nor MW nor MWSS, or the mask has another shape.
    DataError
        The map is complex, or nothing is visible.
    ParameterError
        The limits are not two finite numbers, the lower one first, or there is no such colour map.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> image = plot_mollweide(Figure().subplots(), np.arange(48) - 24.0, limits=(-30, 30))
    >>> image.get_clim()
    (-30.0, 30.0)
    """
    _require_matplotlib()
    values = _visible(sky, mask)
    low, high = _limits(values, limits)
    colours = colour_map or (SIGNED_COLOURS if low < 0 < high else UNSIGNED_COLOURS)
    picture = Projection(rows=RASTER_ROWS).raster.picture(values)
    image = _draw_sky(axes, picture, colours)
    image.set_clim(low, high)
    axes.set_title(title)
    _draw_colour_bar(axes, image, values, _unit_of(sky) if unit is None else unit)
    return image


def plot_projection(  # noqa: PLR0913 - what a reader of a map has to be told
    axes: Axes,
    sky: Sky,
    projection: Projection,
    *,
    title: str = "",
    unit: str | None = None,
    mask: ArrayLike | None = None,
    limits: Limits | None = None,
    colour_map: str | None = None,
) -> AxesImage:
    """Draw a map in any projection, with its colour bar: a patch of the sky, or all of it.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Ordinary axes; their frame is taken away.
    sky : HealpixMap, or array_like, real
        As for `plot_mollweide`. Of a field with spin draw the parts of
        `spinsdw.projections.project_map`, whose frame is the picture's.
    projection : Projection
        Such as ``Projection("gnomonic", centre=(0.5, 1.0), radius=0.2)``.
    title, unit, mask, limits, colour_map
        As for `plot_mollweide`.

    Returns
    -------
    matplotlib.image.AxesImage
        The picture; coordinates of the axes are those of the plane of projection.

    Raises
    ------
    MissingPackageError, ShapeError, DataError, ParameterError
        As for `plot_mollweide`.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> sky = np.arange(48) - 24.0
    >>> image = plot_projection(Figure().subplots(), sky, Projection("orthographic", rows=50))
    >>> image.get_array().shape
    (50, 50)
    """
    _require_matplotlib()
    values = _visible(sky, mask)
    low, high = _limits(values, limits)
    colours = colour_map or (SIGNED_COLOURS if low < 0 < high else UNSIGNED_COLOURS)
    width, height = projection.half_size
    image = axes.imshow(
        projection.raster.picture(values),
        extent=(-width, width, -height, height),
        cmap=_palette(colours),
        interpolation="nearest",
    )
    outside = np.isnan(projection.raster.colatitudes)
    # White above the grey of hidden sky, and clear within the edge.
    axes.imshow(
        np.where(outside[..., None], 1.0, [1.0, 1.0, 1.0, 0.0]) * np.ones((1, 1, 4)),
        extent=image.get_extent(),
        interpolation="nearest",
    )
    image.set_clim(low, high)
    axes.set_title(title)
    axes.set_axis_off()
    _draw_colour_bar(axes, image, values, _unit_of(sky) if unit is None else unit)
    return image


def mollweide_figure(  # noqa: PLR0913 - what a reader of a map has to be told
    sky: Sky,
    *,
    title: str = "",
    unit: str | None = None,
    mask: ArrayLike | None = None,
    limits: Limits | None = None,
    colour_map: str | None = None,
) -> Figure:
    """Make a figure of one map of the whole sky; the arguments are those of `plot_mollweide`.

    Parameters
    ----------
    sky : HealpixMap, or array_like, real
        A HEALPix map in RING order or a map on an MW or MWSS grid.
    title, unit, mask, limits, colour_map
        As for `plot_mollweide`.

    Returns
    -------
    matplotlib.figure.Figure
        To be kept with `save_figure`.

    Raises
    ------
    MissingPackageError, ShapeError, DataError, ParameterError
        As for `plot_mollweide`.

    Examples
    --------
    >>> figure = mollweide_figure(np.arange(48.0), title="pixel number")
    >>> figure.axes[0].get_title()
    'pixel number'
    """
    figure = _new_figure(7.2)
    style: dict[str, Any] = {"unit": unit, "mask": mask, "limits": limits}
    plot_mollweide(figure.subplots(), sky, title=title, colour_map=colour_map, **style)
    return figure


def figure_grid(  # noqa: PLR0913 - what a reader of maps has to be told
    maps: Mapping[str, Sky],
    *,
    columns: int = 2,
    unit: str | None = None,
    mask: ArrayLike | None = None,
    limits: Limits | None = None,
    colour_map: str | None = None,
) -> Figure:
    """Make a figure of several maps of the whole sky, row by row.

    Parameters
    ----------
    maps : mapping of str to HealpixMap or array_like
        Title to map; see `plot_mollweide`.
    columns : int
        Maps in a row.
    unit, mask, limits, colour_map
        As for `plot_mollweide`, the same for every map. Maps to be compared need `limits`.

    Returns
    -------
    matplotlib.figure.Figure
        To be kept with `save_figure`.

    Raises
    ------
    MissingPackageError, ShapeError, DataError
        As for `plot_mollweide`.
    ParameterError
        There is no map, `columns` is less than 1, or as for `plot_mollweide`.

    Examples
    --------
    >>> figure = figure_grid({"E": np.arange(48.0), "B": np.arange(48.0)}, limits=(0, 50))
    >>> [axes.get_title() for axes in figure.axes if axes.get_title()]
    ['E', 'B']
    """
    if not maps or not isinstance(columns, int) or columns < 1:
        msg = f"columns={columns!r} and {len(maps)} maps must both be at least 1; give some maps."
        raise ParameterError(msg)
    columns = min(columns, len(maps))
    rows = math.ceil(len(maps) / columns)
    figure = _new_figure(5.0, rows, columns)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, (title, sky) in zip(panels, maps.items(), strict=False):
        plot_mollweide(
            axes, sky, title=title, unit=unit, mask=mask, limits=limits, colour_map=colour_map
        )
    for axes in panels[len(maps) :]:
        axes.remove()
    return figure


def plot_tiling(axes: Axes, tiling: Tiling) -> None:
    """Draw the scaling function and the wavelets of a tiling against the degree.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Ordinary axes, of pyplot or of a figure.
    tiling : Tiling
        Any object with ``bandlimit``, ``scales``, ``kernel(j)`` and ``scaling_kernel``.

    Raises
    ------
    MissingPackageError
        matplotlib is not installed.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from spinsdw.tiling import ScaleDiscretisedTiling
    >>> axes = Figure().subplots()
    >>> plot_tiling(axes, ScaleDiscretisedTiling(64))
    >>> len(axes.lines)
    7
    """
    _require_matplotlib()
    from matplotlib import colormaps

    scales = list(tiling.scales)
    # The last fifth of viridis is too pale for a line on white.
    colours = colormaps["viridis"](np.linspace(0, 0.8, len(scales)))
    axes.set_xlim(0.9, 1.1 * max(2, tiling.bandlimit - 1))
    kernels = {f"{scale}": tiling.kernel(scale) for scale in scales}
    peaks = [_draw_kernel(axes, *item) for item in zip(kernels.values(), colours, strict=True)]
    _draw_labels(axes, dict(zip(kernels, peaks, strict=True)), colours)
    if np.any(tiling.scaling_kernel[1:]):
        peak = _draw_kernel(axes, tiling.scaling_kernel, LINE_COLOUR, linestyle="--")
        axes.annotate(r"$\eta$", (peak, 1.03), ha="center", color=LINE_COLOUR)
    axes.set_xscale("log", base=2)
    axes.xaxis.set_major_formatter("{x:.0f}")
    axes.set_ylim(0, 1.12)
    axes.set_xlabel(r"degree $\ell$")
    axes.set_ylabel(r"$\eta(\ell)$,  $\kappa_j(\ell)$")
    axes.spines[["top", "right"]].set_visible(False)


def tiling_figure(tiling: Tiling) -> Figure:
    """Make a figure of a tiling, as `plot_tiling` draws it.

    Parameters
    ----------
    tiling : Tiling

    Returns
    -------
    matplotlib.figure.Figure
        To be kept with `save_figure`.

    Raises
    ------
    MissingPackageError
        matplotlib is not installed.

    Examples
    --------
    >>> from spinsdw.tiling import SplineTiling
    >>> len(tiling_figure(SplineTiling(64)).axes)
    1
    """
    figure = _new_figure(6.4)
    figure.set_size_inches(6.4, 3.0)
    plot_tiling(figure.subplots(), tiling)
    return figure


def save_figure(figure: Figure, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write a figure to a file, complete or not at all.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Any figure.
    path : str or path-like
        A local file in an existing directory; its suffix says the format, such as ``.png``,
        ``.pdf`` or ``.svg``.
    overwrite : bool
        Replace a file that is there.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    OutputExistsError
        The file exists and `overwrite` is False.
    ParameterError
        The suffix is no format of matplotlib, the directory does not exist, or `path` is a URL.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     figure = mollweide_figure(np.arange(48.0))
    ...     save_figure(figure, f"{directory}/map.png").stat().st_size > 1000
    True
    """
    target = output_path(path, overwrite=overwrite)
    suffix, known = target.suffix.lower().lstrip("."), figure.canvas.get_supported_filetypes()
    if suffix not in known:
        msg = f"path={str(target)!r} must end in one of {sorted(known)}; .png suits maps."
        raise ParameterError(msg)
    with atomic_output(target, overwrite=overwrite) as stream:
        figure.savefig(stream, format=suffix, dpi=150)
    return target


def _require_matplotlib() -> None:
    try:
        import matplotlib  # noqa: F401 - only to see whether it is there
    except ImportError as error:
        msg = "matplotlib is not installed and must be for plotting; pip install 'spinsdw[plot]'."
        raise MissingPackageError(msg) from error


def _new_figure(width: float, rows: int = 1, columns: int = 1) -> Figure:
    """Make a figure for maps so many inches wide."""
    _require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    # A map is half as high as wide; its title and colour bar take the rest.
    size = (width * columns, (width / 2 + 1.15) * rows)
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _visible(sky: Sky, mask: ArrayLike | None) -> NDArray[np.float64]:
    """Return the map with nan where it is hidden."""
    sentinel = sky.sentinel if isinstance(sky, HealpixMap) else None
    values = np.asarray(sky.values if isinstance(sky, HealpixMap) else sky)
    if values.dtype.kind not in "buif":
        msg = f"map has dtype {values.dtype} but must be real; plot .real and .imag apart."
        raise DataError(msg)
    hidden = bad_pixel_mask(values, sentinel)
    if mask is not None:
        weights = np.asarray(mask)
        if weights.shape != values.shape:
            msg = f"mask has shape {weights.shape} and the map {values.shape}; give them one."
            raise ShapeError(msg)
        hidden = hidden | (weights == 0)
    if np.all(hidden):
        msg = f"all {values.size} values of the map are hidden; some must be visible to be drawn."
        raise DataError(msg)
    return np.where(hidden, np.nan, values)


def _limits(values: NDArray[np.float64], limits: Limits | None) -> Limits:
    if limits is None:
        return _robust_limits(values[np.isfinite(values)])
    low, high = (float(limit) for limit in limits)
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        msg = f"limits={limits!r} must be two finite numbers, the lower one first; or leave it out."
        raise ParameterError(msg)
    return low, high


def _robust_limits(shown: NDArray[np.float64]) -> Limits:
    """Return limits that leave out the extreme values, or all if those are the only ones."""
    low, high = float(shown.min()), float(shown.max())
    if low < 0 < high:
        moduli = np.abs(shown)
        end = float(np.percentile(moduli, ROBUST_PERCENTILE)) or float(moduli.max())
        return -end, end
    inner = np.percentile(shown, [100 - ROBUST_PERCENTILE, ROBUST_PERCENTILE])
    return (float(inner[0]), float(inner[1])) if inner[0] < inner[1] else (low, high)


def _unit_of(sky: Sky) -> str:
    return sky.unit if isinstance(sky, HealpixMap) and sky.unit != "unknown" else ""


def _palette(colours: str) -> Any:
    from matplotlib import colormaps

    if colours not in colormaps:
        msg = f"colour_map={colours!r} must be a colour map of matplotlib, such as 'RdBu_r'."
        raise ParameterError(msg)
    return colormaps[colours].with_extremes(bad=HIDDEN_COLOUR)


def _draw_sky(axes: Axes, picture: NDArray[np.float64], colours: str) -> AxesImage:
    from matplotlib.patches import Ellipse

    palette = _palette(colours)
    image = axes.imshow(picture, extent=(-2, 2, -1, 1), cmap=palette, interpolation="nearest")
    ellipse = Ellipse((0, 0), 4, 2, facecolor="none", edgecolor=LINE_COLOUR, linewidth=0.8)
    axes.add_patch(ellipse)
    image.set_clip_path(ellipse)
    _draw_graticule(axes)
    # Room for the outline, which is half outside the picture.
    axes.set_xlim(-2.02, 2.02)
    axes.set_ylim(-1.02, 1.02)
    axes.set_axis_off()
    return image


def _draw_graticule(axes: Axes) -> None:
    style: dict[str, Any] = {"color": LINE_COLOUR, "linewidth": 0.4, "alpha": 0.35}
    auxiliary = np.linspace(-np.pi / 2, np.pi / 2, 181)
    for longitude in np.radians([-120, -60, 0, 60, 120]):
        axes.plot(2 * longitude / np.pi * np.cos(auxiliary), np.sin(auxiliary), **style)
    sines = (2 * auxiliary + np.sin(2 * auxiliary)) / np.pi
    for latitude in np.radians([-60, -30, 0, 30, 60]):
        height = np.interp(np.sin(latitude), sines, np.sin(auxiliary))
        width = 2 * math.sqrt(1 - height**2)
        axes.plot([-width, width], [height, height], **style)


def _draw_colour_bar(axes: Axes, image: AxesImage, values: NDArray[np.float64], unit: str) -> None:
    low, high = image.get_clim()
    below, above = bool(np.nanmin(values) < low), bool(np.nanmax(values) > high)
    extend = ("neither", "min", "max", "both")[below + 2 * above]
    bar = axes.figure.colorbar(
        image, ax=axes, orientation="horizontal", shrink=0.6, aspect=30, pad=0.04, extend=extend
    )
    bar.set_label(unit)
    bar.outline.set_linewidth(0.6)
    bar.ax.locator_params(nbins=4)


def _draw_kernel(axes: Axes, kernel: NDArray[np.float64], colour: Any, **style: Any) -> float:
    """Draw a kernel where it is not zero; return the middle of its top."""
    support = np.flatnonzero(kernel[1:]) + 1
    if not support.size:
        return math.nan
    degrees = np.arange(max(1, support[0] - 1), min(kernel.size, support[-1] + 2))
    axes.plot(degrees, kernel[degrees], color=colour, linewidth=1.5, **style)
    top = degrees[kernel[degrees] >= 0.99 * kernel[degrees].max()]
    return math.sqrt(top[0] * top[-1])


def _draw_labels(axes: Axes, peaks: Mapping[str, float], colours: NDArray[Any]) -> None:
    """Write the scales above their kernels, as many as have room; an empty one has no peak."""
    room = axes.get_xlim()[1] ** 0.055
    axes.annotate("$j$", (-0.03, 1.03), xycoords=("axes fraction", "data"), ha="right")
    written = 0.0
    for (name, peak), colour in zip(peaks.items(), colours, strict=True):
        if peak >= written * room:
            axes.annotate(name, (peak, 1.03), ha="center", color=colour)
            written = peak
