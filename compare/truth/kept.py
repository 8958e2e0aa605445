"""Arrays that were computed once, in tmt's folder of object files and by its rules; see tmt.compiled.store."""

import hashlib
import io
from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np

import tmt
from tmt.compiled import store
from tmt.compiled.machine import versions
from tmt.compiled.sources import own_sources


def kept(
    compute: Callable[[], Sequence[np.ndarray]], tree: tmt.Tree, *what: str | tuple[object, ...]
) -> list[np.ndarray]:
    """What compute returns, from the folder if it lies there. what: all that it follows from beside the Tree and tmt itself."""
    words, folder = [own_sources(), store.word_of(tree)], store.cache_folder()
    parts = [word for word in words if word is not None]
    if len(parts) < len(words) or folder is None:
        return list(compute())
    name = hashlib.sha256("\n".join([*parts, versions(), repr(what)]).encode()).hexdigest()[:32]
    path = folder / f"{name}.npz"
    with suppress(OSError):
        content = path.read_bytes()
        if content[: store.DIGEST] == store.digest(path, content[store.DIGEST :]):
            with np.load(io.BytesIO(content[store.DIGEST :]), allow_pickle=False) as arrays:
                return list(arrays.values())
    arrays, file = list(compute()), io.BytesIO()
    np.savez(file, *arrays)
    with suppress(OSError):
        store.write_aside(path, store.digest(path, file.getvalue()) + file.getvalue())
    return arrays
