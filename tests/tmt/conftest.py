import pytest


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder of the store that is not there yet."""
    monkeypatch.setenv("TMT_CACHE", str(tmp_path / "new" / "cache"))
    return tmp_path / "new" / "cache"
