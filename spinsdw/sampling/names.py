"""The names samplings go by."""

from __future__ import annotations

from spinsdw.errors import ParameterError
from spinsdw.sampling.base import Sampling
from spinsdw.sampling.equiangular import MW, MWSS
from spinsdw.sampling.gauss_legendre import GaussLegendre
from spinsdw.sampling.uniform_rings import ClenshawCurtis, DriscollHealy, Fejer1

__all__ = ["SAMPLINGS", "resolve_sampling"]

SAMPLINGS: dict[str, type[Sampling]] = {
    kind.name: kind for kind in (MW, MWSS, DriscollHealy, GaussLegendre, ClenshawCurtis, Fejer1)
}


def resolve_sampling(sampling: str | Sampling, bandlimit: int) -> Sampling:
    """Return the sampling object meant by a name or by an object of the same bandlimit.

    Parameters
    ----------
    sampling : str or Sampling
        "mw", "mwss", "dh", "gl", "cc", "fejer1" or an object.
    bandlimit : int
        What the object must have, or is made with.

    Returns
    -------
    Sampling
        The grid.

    Raises
    ------
    ParameterError
        If the name is not known, or the object has another bandlimit.

    Examples
    --------
    >>> resolve_sampling("mwss", 8).shape
    (9, 16)
    """
    if isinstance(sampling, Sampling):
        if sampling.bandlimit != bandlimit:
            msg = (
                f"sampling has bandlimit {sampling.bandlimit} but the transform has "
                f"{bandlimit}; make the sampling with the transform's bandlimit."
            )
            raise ParameterError(msg)
        return sampling
    if not isinstance(sampling, str) or sampling.lower() not in SAMPLINGS:
        names = ", ".join(repr(name) for name in SAMPLINGS)
        msg = f"sampling={sampling!r} is not known; use one of {names} or a Sampling object."
        raise ParameterError(msg)
    return SAMPLINGS[sampling.lower()](bandlimit)
