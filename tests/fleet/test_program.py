"""Which program it is: another one as soon as a source, a model or what it computes with is another."""

import pytest

from compare.fleet import program as module

SOURCES = ["compare/a.py", "compare/deep/page.html", "compare/page.js", "mjcf/arm.xml", "tmt/b.py"]


def which():
    return module.program.__wrapped__()


@pytest.fixture
def root(tmp_path, monkeypatch):
    for name in [*SOURCES, "compare/a.pyc", "tests/test_a.py"]:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("1")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", SOURCES)
def test_a_source_that_changes_or_moves_makes_another_program(name, root):
    before = which()
    (root / name).rename((root / name).with_stem("other"))
    moved = which()
    (root / name).with_stem("other").rename(root / name)
    assert which() == before != moved
    (root / name).write_text("2")
    assert which() not in (before, moved)


@pytest.mark.parametrize("name", ["compare/a.pyc", "tests/test_a.py"])
def test_what_is_no_source_of_it_does_not(name, root):
    before = which()
    (root / name).write_text("2")
    assert which() == before


@pytest.mark.parametrize("changed", ["mujoco", "numpy", "scipy", "llvmlite", "mpmath"])
def test_another_version_of_what_it_computes_with_makes_another_program(changed, root, monkeypatch):
    before = which()
    monkeypatch.setattr(module, "installed", lambda name: "0" if name == changed else "1")
    other = which()
    monkeypatch.setattr(module, "installed", lambda name: "1")
    assert len({before, other, which()}) == 3
