"""Robots whose momentum nothing at the world holds."""

import tmt

FREE = ("slide", "slide", "slide", "ball")


def floats(tree: tmt.Tree) -> bool:
    """Whether a joint to the world is free (three slides and a ball): such a robot has no rest under gravity."""
    return any(tree.parent[i] == -1 and tree.kind[i : i + 4] == FREE for i in range(len(tree.kind) - 3))
