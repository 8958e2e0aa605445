"""A piece whose code is sent with it: for what is no part of the program, and so may be another elsewhere."""

from functools import lru_cache
from types import ModuleType


def sent_call(code: str, name: str, *given: object) -> object:
    """What a function returns for what is given: one of the module of this code, which imports nothing that is sent."""
    return getattr(module_of_code(code), name)(*given)


@lru_cache(4)
def module_of_code(code: str) -> ModuleType:
    """The module of a code, made once in a process."""
    made = ModuleType("sent")
    exec(compile(code, "<sent>", "exec"), vars(made))
    return made
