"""Former names of fields, accepted for one release with a DeprecationWarning."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import wraps
from typing import Any


def accepts_former_names(former: Mapping[str, str]) -> Callable[[type], type]:
    """A decorator of a dataclass: it accepts and has the fields `former`, {former name: name}.

    ValueError for a field that is none.
    """

    def decorated(cls: type) -> type:
        initialize = cls.__init__
        known = [field.name for field in fields(cls)]

        @wraps(initialize)
        def __init__(self: Any, *values: Any, **named: Any) -> None:
            for name in (
                former.keys() & named.keys()
            ):  # those of dataclasses.replace stand beside the new ones
                warn(cls, name, former[name])
                named[former[name]] = named.pop(name)
            if unknown := [name for name in named if name not in known]:
                raise ValueError(
                    f"a {cls.__name__} has no field {unknown[0]!r}; its fields are {', '.join(known)}"
                )
            initialize(self, *values, **named)

        def property_of(name: str) -> property:
            def value(self: Any) -> Any:
                warn(cls, name, former[name])
                return getattr(self, former[name])

            return property(value, doc=f"Former name of `{former[name]}`.")

        cls.__init__ = __init__
        for name in former:
            setattr(cls, name, property_of(name))
        return cls

    return decorated


def warn(cls: type, name: str, new: str) -> None:
    text = f"{cls.__name__}.{name} is called {new}; the former name will be removed in version 3"
    warnings.warn(text, DeprecationWarning, stacklevel=3)
