"""A cache folder of a test, and code that somebody else may have put there."""

import os

import pytest

from tmt import cache

posix = pytest.mark.skipif(os.name != "posix", reason="rights are bits on POSIX only")
ran = []


@pytest.fixture(name="folder")
def new_folder(tmp_path, monkeypatch):
    """A cache folder that is not there yet, with nothing said about any."""
    monkeypatch.setenv("TMT_CACHE", str(tmp_path / "new" / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(cache, "complaints", [])
    ran.clear()
    return tmp_path / "new" / "cache"


def record(what):
    ran.append(what)


class Planted:
    """Runs `record` when it is unpickled."""

    def __reduce__(self):
        return record, ("planted",)
