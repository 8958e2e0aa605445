"""Names and lists as parts of sentences."""

from collections.abc import Sequence


def capital(text: str) -> str:
    """A text with a capital at its beginning."""
    return text[:1].upper() + text[1:]


def scene_begins(name: str, robot) -> str:
    """A scene's name at the beginning of a sentence; the name of a user's scene stays as it is."""
    is_own = any(scene.name == name and "own" in scene.tags for scene in robot.scenes)
    return f"Scene {name}" if is_own else capital(name)


def posture_begins(name: str, robot) -> str:
    """A posture's name at the beginning of a sentence; the name of a file's keyframe stays as it is."""
    return f"Posture {name}" if name in robot.positions else capital(name)


def listed(words: Sequence[str]) -> str:
    """a, b and c."""
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))
