"""`compiled`: functions of tmt itself, compiled by numba, with their machine code in the cache folder of cache.py.

Of itself numba would take a folder ($NUMBA_CACHE_DIR, beside the source, ~/.cache/numba) without a look at who else can write
there, and a damaged file would end the call. Where the cache folder cannot be used, machine code stays in memory.
"""

import hashlib
import inspect
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib.metadata import version
from types import FunctionType, ModuleType

from numba import njit
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.dispatcher import Dispatcher

from tmt.cache import NotOwn, complain, own_folder, own_machine_code


class Place(CompileResultCacheImpl):
    """Where the machine code of a function is kept, under which name, and to which source it belongs.

    Its members are what numba asks for.
    """

    def __init__(self, function):
        module = sys.modules[function.__module__]
        source = "\n".join([version("numba"), sys.version, *sources(module)])
        self.stamp = hashlib.sha256(source.encode()).hexdigest()
        name = module.__name__.rpartition(".")[2]
        self.path = own_machine_code(own_folder(), name)
        self.name = f"{name}.{function.__name__}-{self.stamp[:16]}"

    @property
    def locator(self):
        return self

    @property
    def filename_base(self):
        return self.name

    def get_cache_path(self):
        return str(self.path)

    def get_source_stamp(self):
        return self.stamp

    def ensure_cache_path(self):
        """It is there since the function was made."""


def sources(module: ModuleType) -> list[str]:
    """What the machine code of a module's functions is made from: its source, the numbers in it, and those of what it calls."""
    modules, found = [module], []
    for each in modules:
        found.append(inspect.getsource(each))
        for name, value in sorted(vars(each).items()):
            if isinstance(value, int | float):
                found.append(f"{name} = {value!r}")
            elif is_followed(value, module) and (other := sys.modules[value.__module__]) not in modules:
                modules.append(other)
    return found


def is_followed(value, module) -> bool:
    """Whether a value of a module, compiled or a plain function of its package, may be in the machine code of what is there."""
    if isinstance(value, FunctionType):
        package, *_ = module.__name__.split(".")
        return value.__module__.split(".")[0] == package and value.__module__ != __name__
    return isinstance(value, Dispatcher)


class Cache(FunctionCache):
    """numba's cache of one function; what cannot be read is compiled anew, what cannot be written is not kept."""

    _impl_class = Place

    def load_overload(self, *which):
        try:
            return super().load_overload(*which)
        except Exception:  # whatever a damaged file makes of it
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, *what):
        with suppress(Exception):
            super().save_overload(*what)


def compiled(function: Callable) -> Callable:
    """The function, compiled when it is first called with arguments of these types, or read from the cache folder."""
    made = njit(error_model="numpy", nogil=True)(function)
    try:
        made._cache = Cache(function)  # as numba does for cache=True
    except NotOwn as error:
        complain(error)
    except Exception:  # whatever is wrong with the folder, or another numba: it only costs time
        pass
    return made


def part(function: Callable) -> Callable:
    """A function that is compiled as a part of others alone: a call that hands arrays on would count who holds them."""
    return njit(error_model="numpy", forceinline=True)(function)
