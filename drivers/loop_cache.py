"""Folders of compiled loops: numba's own, and others for accounts that cannot write there.

A loop is loaded from next to its module if ``snakewalk tools compile`` has stored it there. Else
it is compiled, and stored in the first folder that this account may write to: next to its module,
in the cache of its home folder, or in the folder for temporary files.
"""

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from types import CodeType
from typing import Any

from numba.core import caching

from snakewalk.drivers.fallbacks import report_fallback


class _Temporary(caching.UserWideCacheLocator):  # type: ignore[misc]  # numba has no types
    """A folder of this account below the one for temporary files."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        self.folder = os.path.join(
            tempfile.gettempdir(),
            (f"snakewalk-{os.getuid()}-loops" if hasattr(os, "getuid") else "snakewalk-loops"),
        )
        self._cache_path = os.path.join(self.folder, self.get_suitable_cache_subpath(py_file))

    def ensure_cache_path(self) -> None:
        """Make the folder, which nobody else may write to: numba executes the files in it."""
        with suppress(FileExistsError):
            os.mkdir(self.folder, mode=0o700)
        info = os.lstat(self.folder)
        is_own_folder = not hasattr(os, "getuid") or (
            info.st_uid == os.getuid() and not info.st_mode & 0o022
        )
        if not (stat.S_ISDIR(info.st_mode) and is_own_folder):
            raise PermissionError(self.folder)
        super().ensure_cache_path()

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> "_Temporary | None":
        """Return None without a folder for temporary files."""
        try:
            cached: _Temporary | None = super().from_function(py_func, py_file)
        except OSError:
            cached = None
        return cached


class _ReadOnly(caching.InTreeCacheLocator):  # type: ignore[misc]  # numba has no types
    """The folder next to the module, although loops cannot be stored in it."""

    def ensure_cache_path(self) -> None:
        """Not created."""


class _Folders(caching.CompileResultCacheImpl):  # type: ignore[misc]  # numba has no types
    """The first usable folder; unlike numba, never none."""

    _locator_classes = [  # noqa: RUF012  the name and type that numba chose
        *caching.CompileResultCacheImpl._locator_classes,
        _Temporary,
        _ReadOnly,
    ]


class LoopCache(caching.FunctionCache):  # type: ignore[misc]  # numba has no types
    """The cache of one loop."""

    _impl_class = _Folders
    _cache_file: Any

    def __init__(self, py_func: Any) -> None:
        super().__init__(py_func)
        impl = self._impl
        stamp = (impl.locator.get_source_stamp(), tuple(sorted(_called_code(py_func, {py_func}))))
        stored = caching.InTreeCacheLocator(py_func, impl.locator._py_file)
        self._cache_file, self._stored = (
            caching.IndexDataCacheFile(
                cache_path=path, filename_base=impl.filename_base, source_stamp=stamp
            )
            for path in (self._cache_path, stored.get_cache_path())
        )
        self._has_stored = isinstance(impl.locator, caching.UserWideCacheLocator)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled loop, or None."""
        if self._has_stored and (cached_code := self._load_stored(sig, target_context)) is not None:
            return cached_code
        with suppress(OSError):
            return super().load_overload(sig, target_context)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store a compiled loop if a folder is writable."""
        locator = self._impl.locator
        if isinstance(locator, _Temporary):
            report_fallback(
                "cache",
                f"compiled loops are stored in {locator.folder}, because neither snakewalk's "
                "folder nor the cache in the home folder is writable",
            )
        try:
            super().save_overload(sig, data)
        except OSError as error:
            report_fallback(
                "cache",
                f"compiled loops cannot be stored ({error.strerror or error}), and each start "
                "compiles them again; name a writable folder by NUMBA_CACHE_DIR",
            )

    def _load_stored(self, sig: Any, target_context: Any) -> Any:
        """Load a loop that another account has stored next to its module."""
        usual = self._cache_file
        self._cache_file = self._stored
        try:
            return super().load_overload(sig, target_context)
        except OSError:
            return None
        finally:
            self._cache_file = usual


def _called_code(loop: Any, visited: set[Any]) -> Iterator[str]:
    """Describe the numbers and the functions of other files that are compiled into a loop.

    numba compares only the loop's own file, and would go on with the former text of the others.
    """
    for name in _names(loop.__code__):
        value = loop.__globals__.get(name)
        if isinstance(value, int | float | str | tuple):
            yield f"{name} = {value!r}"
            continue
        function = getattr(value, "py_func", value)
        if not hasattr(function, "__code__") or function in visited:
            continue
        visited.add(function)
        with suppress(OSError):  # in an archive
            yield f"{name}: {_file_stamp(function.__code__.co_filename)}"
        yield from _called_code(function, visited)


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


@cache
def _file_stamp(file: str) -> tuple[float, int]:
    info = os.stat(file)
    return info.st_mtime, info.st_size
