"""Functions that are compiled as parts of kernels only."""

from __future__ import annotations

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys

from spinsdw.compiled import jit
from tests.helpers import needs_compiler

pytestmark = needs_compiler

VALUES = np.arange(5.0)


@jit.inner
def add_squares(values):
    total = 0.0
    for r in range(values.size):
        total += values[r] * values[r]
    return total


@jit.inner
def add_twice(values):
    return add_squares(values) + add_squares(values[:])


def add_thrice(values):
    return add_squares(values) + add_twice(values)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty folder of its own as the cache."""
    monkeypatch.setenv("SPINSDW_CACHE", str(tmp_path))
    return tmp_path


def test_a_kernel_is_kept_with_all_that_it_calls(cache):
    for hits in (0, 1):
        kernel = jit.kernel(add_thrice)
        assert kernel(VALUES) == 90.0
        assert sum(kernel.stats.cache_hits.values()) == hits
    assert len(list(cache.rglob("*.nbc"))) == 1


@pytest.mark.usefixtures("cache")
def test_parts_are_not_made_machine_code():
    kernel = jit.kernel(add_thrice)
    assert kernel(VALUES) == 90.0
    (found,) = kernel.overloads.values()
    engine = found.library.codegen._engine
    assert engine.is_symbol_defined(found.fndesc.llvm_func_name)
    for part in (add_squares, add_twice):
        for overload in part.overloads.values():
            assert not engine.is_symbol_defined(overload.fndesc.llvm_func_name)


@pytest.mark.usefixtures("cache")
@pytest.mark.parametrize("is_compiled", [False, True])
def test_parts_may_be_called_from_python(is_compiled):
    """They have no entry point: numba would jump to address zero."""

    @jit.inner
    def add(values):
        return add_twice(values)

    kernel = jit.kernel(lambda values: add(values) + add_squares(values))
    if is_compiled:
        assert kernel(VALUES) == 90.0
    assert add(VALUES) == 60.0
    assert add(VALUES[::2]) == 40.0
    assert add(VALUES) == 60.0
    assert kernel(VALUES) == 90.0


@pytest.mark.usefixtures("cache")
def test_room_is_given_back():
    @jit.room
    def make(size):
        return np.ones(size), (np.full(size, 2.0),)

    @jit.kernel
    def add(size):
        one, (other,) = make(size)
        return add_squares(one) + add_squares(other)

    add(3)
    _nrt_python.memsys_enable_stats()
    before = rtsys.get_allocation_stats()
    assert [add(size) for size in range(100)] == [5.0 * size for size in range(100)]
    after = rtsys.get_allocation_stats()
    _nrt_python.memsys_disable_stats()
    assert after.mi_alloc - before.mi_alloc == 200
    assert after.mi_free - before.mi_free == 200


@pytest.mark.usefixtures("cache")
def test_another_numba_may_compile_parts_as_it_likes(monkeypatch):
    monkeypatch.setattr(jit, "is_possible", lambda: False)

    @jit.inner
    def add(values):
        return add_squares(values)

    assert jit.kernel(lambda values: 2 * add(values))(VALUES) == 60.0
    assert add(VALUES) == 30.0
    assert add.overloads
