"""Names and lists as parts of sentences."""

from collections.abc import Sequence


def capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def scene_begins(name: str, robot) -> str:
    """A scene's name at the beginning of a sentence; the name of a user's scene stays as it is."""
    is_own = any(scene.name == name and "own" in scene.tags for scene in robot.scenes)
    return f"Scene {name}" if is_own else capital(name)


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


def milliseconds(time: float, near: float | None = None) -> str:
    """A time in s with two digits, 2 ms; with four where it is near another one."""
    digits = 4 if near and abs(time / near - 1.0) < 0.1 and time != near else 2
    return f"{float(f'{1e3 * time:.{digits}g}'):g} ms"
