import pytest

from tmt.compiled import store


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder of the store that is not there yet, with nothing said about any."""
    monkeypatch.setenv("TMT_CACHE", str(tmp_path / "new" / "cache"))
    monkeypatch.setattr(store, "complaints", [])
    return tmp_path / "new" / "cache"
