"""Former names of fields, accepted for one release with a DeprecationWarning."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import partial, wraps
from typing import Any


def accepts_former_names(former: Mapping[str, str]) -> Callable[[Any], Any]:
    """A decorator: a class accepts and has the fields {former name: name}; ValueError for one that is none."""

    def decorated(cls: Any) -> Any:
        initialize, known = cls.__init__, [field.name for field in fields(cls)]

        @wraps(initialize)
        def __init__(self: Any, *values: Any, **named: Any) -> None:
            for name in former.keys() & named.keys():  # dataclasses.replace gives the new ones too
                warn(name, former[name])
                named[former[name]] = named.pop(name)
            if unknown := [name for name in named if name not in known]:
                expected = f"its fields are {', '.join(known)}"
                raise ValueError(f"a {cls.__name__} has no field {unknown[0]!r}; {expected}")
            initialize(self, *values, **named)

        cls.__init__ = __init__
        for name, new in former.items():
            setattr(cls, name, property(partial(value, name=name, new=new), doc=f"Former name of `{new}`."))
        return cls

    return decorated


def value(instance: Any, name: str, new: str) -> Any:
    warn(name, new)
    return getattr(instance, new)


def warn(name: str, new: str) -> None:
    text = f"Tree.{name} is called {new}; the former name will be removed in version 3"
    warnings.warn(text, DeprecationWarning, stacklevel=3)
