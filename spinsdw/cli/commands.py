"""`spinsdw`: what may be asked on the command line, and how errors are told."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from spinsdw.cli.requests import Column, MapRequest, MaskRequest, OutputRequest, SeparationRequest
from spinsdw.errors import SpinsdwError

__all__ = ["main"]

Command = TypeVar("Command", bound=Callable[..., Any])

ORDERINGS, POLCONVS = ("RING", "NESTED"), ("COSMO", "IAU")
# The choices of EBSeparator, which is too heavy to be asked for --help; a test holds them equal.
METHODS = (
    "hybrid",
    "projection",
    "wiener",
    "pure",
    "pseudo",
    "masked",
    "recycling",
    "harmonic-pure",
    "needlets",
)
OUTPUTS = ("fields", "derivatives", "potentials")
SYNCHROTRON = "WMAP nine-year synchrotron at 23 GHz: a Galactic foreground, not the CMB."


class _Commands(click.Group):
    """A group whose commands end on an error of the package with one sentence."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command asked for."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            # click ends quietly when the reader of a pipe has gone.
            raise
        except (SpinsdwError, OSError, MemoryError) as error:
            command = self.get_command(ctx, ctx.invoked_subcommand or "")
            raise click.ClickException(_sentence(error, command)) from error


def _sentence(error: BaseException, command: click.Command | None) -> str:
    """Return what an error says, in the words of the command line."""
    if isinstance(error, OSError) and error.strerror:
        text = f"{error.strerror}: {error.filename!r}" if error.filename else error.strerror
    elif isinstance(error, MemoryError) and not isinstance(error, SpinsdwError):
        text = f"the memory of this machine is not enough ({error}); lower --bandlimit."
    else:
        text = str(error)
    for option in command.params if command else ():
        if isinstance(option, click.Option) and option.name:
            flag = option.opts[0] + ("" if option.is_flag else " ")
            value = "(True|False)" if option.is_flag else ""
            text = re.sub(rf"(?<![\w.]){option.name}={value}", flag, text)
    return text


class _ColumnsType(click.ParamType):  # type: ignore[type-arg]
    """A column's name or number, or several with commas between."""

    name = "columns"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[Column, ...]:
        """Return the columns; numbers become integers."""
        words = [word.strip() for word in str(value).split(",")]
        if not all(words) or len(words) > 2:
            self.fail(f"{value!r} must be one column, or two with a comma between.", param, ctx)
        return tuple(int(word) if word.isdecimal() else word for word in words)


def _check_ascii(_: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """Refuse now what a FITS header cannot hold later."""
    if value is not None and not (value.isascii() and value.isprintable()):
        msg = f"{value!r} must be printable ASCII, as FITS headers are; write uK for µK."
        raise click.BadParameter(msg, param=param)
    return value


def _decorate(*options: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Join decorators into one; --help lists the options in this order."""

    def decorated(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return decorated


_map_options = _decorate(
    click.option(
        "--columns", type=_ColumnsType(), help="Of Q and U: names or numbers from 0, as 'Q,U'."
    ),
    click.option("--ordering", type=click.Choice(ORDERINGS), help="If the header lacks it."),
    click.option("--polconv", type=click.Choice(POLCONVS), help="If the header lacks it."),
    click.option("--unit", callback=_check_ascii, help="If the header lacks it, such as K_CMB."),
    click.option("--coordinates", callback=_check_ascii, help="If the header lacks it: G, E or C."),
    click.option(
        "--bad-pixels",
        type=click.Choice(("raise", "mask")),
        default="raise",
        show_default=True,
        help="What to do with NaN in observed pixels; UNSEEN is masked anyway.",
    ),
    click.option("--max-memory", type=click.IntRange(min=1), help="Bytes for a file [4 GiB]."),
)
_mask_options = _decorate(
    click.option("--mask", help="Mask: 1 is observed, 0 is not. Without: the whole sky."),
    click.option("--mask-column", type=_ColumnsType(), default="0", show_default=True),
    click.option("--mask-ordering", type=click.Choice(ORDERINGS), help="If the header lacks it."),
    click.option(
        "--galactic-cut",
        type=click.FloatRange(0, 90, max_open=True),
        metavar="DEG",
        help="Mask latitudes below this instead.",
    ),
    click.option(
        "--fill-holes",
        type=click.FloatRange(0, min_open=True),
        metavar="DEG2",
        help="Observe again what the mask hides in holes up to this area.",
    ),
)
_method_options = _decorate(
    click.option("--bandlimit", type=int, help="Degrees are below it [2 nside + 1]."),
    click.option("--method", type=click.Choice(METHODS), default="hybrid", show_default=True),
    click.option("--directions", type=int, default=1, show_default=True, help="Of the wavelets."),
    click.option("--dilation", type=float, default=2.0, show_default=True, help="Ratio of scales."),
    click.option("--lowest-scale", type=int, help="Larger structures are one part [2]."),
    click.option(
        "--largest-share",
        type=float,
        help="Method pseudo: share of a wavelet's energy in the hole at which it is dropped [0.2].",
    ),
    click.option(
        "--output-kind",
        "output",
        type=click.Choice(OUTPUTS),
        default="fields",
        show_default=True,
        help="E and B, their second derivatives, or their potentials.",
    ),
)
_output_options = _decorate(
    click.option(
        "--output",
        "directory",
        type=click.Path(path_type=Path),
        default="output",
        show_default=True,
        help="Directory for the files.",
    ),
    click.option("--ordering-out", type=click.Choice(ORDERINGS), default="RING", show_default=True),
    click.option("--coefficients", is_flag=True, help="Write the wavelet coefficients too."),
    click.option("--pictures/--no-pictures", default=True, help="PNG pictures [yes]."),
    click.option("--overwrite", is_flag=True, help="Replace files of the same names."),
)
_threads_option = click.option("--threads", type=click.IntRange(min=1), help="[all cores]")


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="spinsdw", prog_name="spinsdw")
def main() -> None:
    """Separate E and B in maps of polarisation with spin wavelets on the sphere."""


@main.command()
@click.argument("qfile")
@click.argument("ufile", required=False)
@_map_options
@_mask_options
@_method_options
@_output_options
@_threads_option
def separate(qfile: str, ufile: str | None, **options: Any) -> None:
    """Separate Q and U, HEALPix maps of one FITS file or of two, into E and B."""
    if options["mask"] is not None and options["galactic_cut"] is not None:
        msg = "--mask and --galactic-cut cannot both be given; cut the mask itself."
        raise click.UsageError(msg)
    if options["fill_holes"] is not None and options["mask"] is None:
        msg = "--fill-holes is about a mask; give one with --mask."
        raise click.UsageError(msg)
    if len(options["mask_column"]) != 1:
        msg = "--mask-column must be one column."
        raise click.UsageError(msg)
    stated = ("columns", "ordering", "polconv", "unit", "coordinates", "bad_pixels")
    maps = MapRequest(
        paths=(qfile,) if ufile is None else (qfile, ufile),
        **{name: options[name] for name in stated},
    )
    mask = MaskRequest(
        path=options["mask"],
        column=options["mask_column"][0],
        ordering=options["mask_ordering"],
        galactic_cut=options["galactic_cut"],
        fill_holes=options["fill_holes"],
    )
    if options["largest_share"] is not None and options["method"] != "pseudo":
        msg = f"--largest-share is a choice of --method pseudo, not of {options['method']}."
        raise click.UsageError(msg)
    names = "bandlimit method directions dilation lowest_scale largest_share output threads"
    given = {name: options[name] for name in names.split() if options[name] is not None}
    wanted = SeparationRequest(maps, mask, _output(options), given, options["max_memory"])
    _run(wanted)


@main.command()
@_output_options
@_threads_option
def demo(threads: int | None, **options: Any) -> None:
    """Separate the bundled WMAP synchrotron map: a Galactic foreground, not the CMB."""
    from spinsdw.datasets import wmap_mask_path, wmap_synchrotron_paths

    q_path, u_path = wmap_synchrotron_paths()
    maps = MapRequest(
        paths=(str(q_path), str(u_path)),
        columns=("BESTFIT",),
        ordering="NESTED",
        polconv="COSMO",
        unit="mK_RJ",
        coordinates="G",
    )
    # The holes at point sources do not matter to a diffuse foreground; the galactic part does.
    mask = MaskRequest(path=str(wmap_mask_path()), fill_holes=100.0)
    wanted = SeparationRequest(
        maps, mask, _output(options), {"threads": threads}, remark=SYNCHROTRON
    )
    _run(wanted)


def _output(options: dict[str, Any]) -> OutputRequest:
    names = ("directory", "coefficients", "pictures", "overwrite")
    return OutputRequest(
        **{name: options[name] for name in names}, ordering=options["ordering_out"]
    )


def _run(wanted: SeparationRequest) -> None:
    from spinsdw.cli.separation import run_separation

    click.echo(run_separation(wanted), nl=False)


@main.command()
def info() -> None:
    """Tell versions, processor and cache, for reports of bugs."""
    from spinsdw.cli.environment import describe

    for name, fact in describe().items():
        click.echo(f"{name:22}{fact}")


@main.command()
@_threads_option
def warmup(threads: int | None) -> None:
    """Compile everything now, so that no later run has to wait for it."""
    click.echo("compiling where nothing is cached, up to a minute", file=sys.stderr)
    from spinsdw.warmup import warm_up

    seconds = warm_up(threads)
    for name, value in seconds.items():
        click.echo(f"{value:8.2f} s  {name}")
    click.echo(f"{sum(seconds.values()):8.2f} s  in all")
