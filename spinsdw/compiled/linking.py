"""How the functions are compiled that only kernels call: as far as kernels need it.

Numba compiles a function together with all that it calls, optimises the whole, makes machine code
of it, and does so once more for each function that calls this one in turn. What is deep down comes
by half a dozen times, and all but the last is thrown away: the kernel at the top has a copy of
everything, optimised for the place where it stands. So `PartCompiler` stops at the code that
numba hands to LLVM. To a first call that is worth half of its time, to later ones nothing.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.dispatcher import Dispatcher

__all__ = ["PartCompiler", "is_possible", "make_callable"]

# What is left out or replaced, none of it promised by numba.
_STAGES = ("_optimize_functions", "_optimize_final_module", "_finalize_final_module")
_CALLS = ("_insert", "_compile_for_args")


def is_possible() -> bool:
    """Return whether this numba has the parts that are replaced here; where not, it does it all."""
    return all(hasattr(JITCodeLibrary, name) for name in _STAGES) and all(
        hasattr(Dispatcher, name) for name in _CALLS
    )


class _Part(JITCodeLibrary):
    """Code that others link: not optimised, and not made machine code."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True


class PartCompiler(Compiler):
    """Numba's compiler for functions that only compiled functions call."""

    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        super().__init__(typing, target, library or _Part(target.codegen(), "part"), *rest)
        # Numba has a copy of the target for each compilation. There is no function for Python, but
        # overloads are told apart by it.
        self.state.targetctx.get_executable = lambda *_: object()


def make_callable(part: Dispatcher, kernel: Any) -> None:
    """Let a function that has no entry point be called from Python, through a kernel of its own.

    Otherwise such a call would end the process.
    """

    @kernel
    def entry(*args):
        return part(*args)

    # Numba asks `_compile_for_args` what to call where it finds no function for Python.
    part._insert = lambda *_: None
    part._compile_for_args = lambda *_: entry
