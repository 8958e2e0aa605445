"""Names and lists as parts of sentences."""

from collections.abc import Sequence
from math import floor, log10


def capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def readable(text: str) -> str:
    """Text without surrogates: bytes that the locale could not decode are read as UTF-8 or escaped."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def in_one_line(text: str) -> str:
    """Readable text in which control characters are escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in readable(text))


def listed(words: Sequence[str]) -> str:
    """a, b and c."""
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def scene_of(place: str, names: Sequence[str]) -> str | None:
    """The scene of a check: the longest name with which its place begins."""
    return max((name for name in names if f"{place},".startswith(f"{name},")), key=len, default=None)


def some_of(words: Sequence[str], most: int = 6) -> str:
    """The first of many words as a list."""
    more = len(words) - most
    return f"{', '.join(words[:most])} and {more} more" if more > 0 else listed(words)


def milliseconds_below(time: float, near: float | None = None) -> str:
    """A limit in s as milliseconds does, rounded down: what is printed is within it."""
    digits = digits_of_time(time, near)
    last = 10.0 ** (floor(log10(1e3 * time)) + 1 - digits)
    return f"{float(f'{floor(1e3 * time / last * (1.0 + 1e-12)) * last:.{digits}g}'):g} ms"


def digits_of_time(time: float, near: float | None) -> int:
    return 4 if near and abs(time / near - 1.0) < 0.1 and time != near else 2


def milliseconds(time: float, near: float | None = None) -> str:
    """A time in s with two digits, 2 ms; with four where it is near another one."""
    return f"{float(f'{1e3 * time:.{digits_of_time(time, near)}g}'):g} ms"
