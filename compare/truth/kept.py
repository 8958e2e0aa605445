"""Arrays that were computed once, in tmt's folder of object files and by its rules; see tmt.compiled.store."""

import io
from collections.abc import Callable, Sequence

import numpy as np

import tmt
from tmt.compiled import store


def kept(
    compute: Callable[[], Sequence[np.ndarray]], tree: tmt.Tree, *what: str | tuple[object, ...]
) -> list[np.ndarray]:
    """What compute returns, from the folder if it lies there. what: all that it follows from beside the Tree and tmt itself."""

    def written() -> bytes:
        file = io.BytesIO()
        np.savez(file, *compute())
        return file.getvalue()

    with np.load(io.BytesIO(store.stored(written, ".npz", tree, *what)), allow_pickle=False) as arrays:
        return list(arrays.values())
