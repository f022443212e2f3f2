"""The exceptions and warnings of the package, and which one is raised when.

==========================  ===================  ==================================================
class                       also a               raised when
==========================  ===================  ==================================================
`ParameterError`            ValueError           a parameter breaks its rule (range, name, type)
`ShapeError`                ValueError           an array has another shape than the object needs
`DataError`                 ValueError           values are unusable: NaN, wrong dtype, out of range
`FileFormatError`           ValueError           a file is unreadable, truncated or not what it says
`OutputExistsError`         FileExistsError      an output exists and overwriting was not asked for
`MemoryBudgetError`         MemoryError          a stated memory budget would be exceeded
`MissingPackageError`       ImportError          an optional package is not installed
`PrecisionWarning`          UserWarning          a result is less accurate than the user may expect
`ConvergenceWarning`        UserWarning          an iteration stopped before its tolerance
==========================  ===================  ==================================================

Every message is one sentence: the parameter, the value received, the rule, the remedy.
"""

from __future__ import annotations

__all__ = [
    "ConvergenceWarning",
    "DataError",
    "FileFormatError",
    "MemoryBudgetError",
    "MissingPackageError",
    "OutputExistsError",
    "ParameterError",
    "PrecisionWarning",
    "ShapeError",
    "SpinsdwError",
]


class SpinsdwError(Exception):
    """Base of every exception the package raises on purpose."""


class ParameterError(SpinsdwError, ValueError):
    """A parameter breaks its rule."""


class ShapeError(SpinsdwError, ValueError):
    """An array has another shape than the object it is given to needs."""


class DataError(SpinsdwError, ValueError):
    """The values of an array cannot be used."""


class FileFormatError(SpinsdwError, ValueError):
    """A file cannot be read as what it should be."""


class OutputExistsError(SpinsdwError, FileExistsError):
    """An output file is there already."""


class MemoryBudgetError(SpinsdwError, MemoryError):
    """A computation would need more memory than allowed."""


class MissingPackageError(SpinsdwError, ImportError):
    """An optional package is needed and not installed."""


class PrecisionWarning(UserWarning):
    """A result is less accurate than the caller may expect."""


class ConvergenceWarning(UserWarning):
    """An iteration stopped before it reached its tolerance."""
