"""TMT and MuJoCo compared; and equations of one's own compared with MuJoCo: `assert_agrees` and `differences`."""

__all__ = ["assert_agrees", "differences"]


def __getattr__(name: str):
    """The two functions when they are asked for: whoever starts `python -m compare` need not wait for them."""
    if name in __all__:
        from . import agreement

        return getattr(agreement, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
