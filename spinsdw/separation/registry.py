"""The methods of separation by name."""

from __future__ import annotations

from spinsdw.errors import ParameterError
from spinsdw.separation.harmonic_pure import HarmonicPure
from spinsdw.separation.hybrid import Hybrid
from spinsdw.separation.masked import Masked
from spinsdw.separation.method import Method
from spinsdw.separation.needlets import SpinNeedlets
from spinsdw.separation.projection import Projection
from spinsdw.separation.pseudo import Pseudo
from spinsdw.separation.pure import Pure
from spinsdw.separation.recycling import Recycling
from spinsdw.separation.report import check_choice
from spinsdw.separation.wiener import Wiener

__all__ = ["METHODS", "resolve_method"]

METHODS: dict[str, type[Method]] = {
    kind.name: kind
    for kind in (
        Hybrid,
        Projection,
        Wiener,
        Pure,
        Pseudo,
        Masked,
        Recycling,
        HarmonicPure,
        SpinNeedlets,
    )
}


def resolve_method(method: object) -> Method:
    """Return the description of a method, given as such or by its name.

    Raises
    ------
    ParameterError
        If a name is not known, or an object is no method.

    Examples
    --------
    >>> resolve_method("pseudo")
    Pseudo(largest_share=0.2)
    """
    if isinstance(method, str):
        check_choice("method", method, tuple(METHODS))
        return METHODS[method]()
    if not isinstance(method, tuple(METHODS.values())):
        msg = (
            f"method={method!r} must be a name among {', '.join(map(repr, METHODS))}, or an object "
            "of one of their classes in spinsdw.separation."
        )
        raise ParameterError(msg)
    return method  # type: ignore[return-value]
