"""What a report says of the program that made it."""

import subprocess

from compare.report import provenance


def test_the_commit_is_said_and_whether_the_program_was_changed_since(tmp_path, monkeypatch):
    monkeypatch.setattr(provenance, "ROOT", tmp_path)
    assert provenance.commit() is None  # no repository

    def git(*words):
        command = ["git", "-c", "user.name=a", "-c", "user.email=a@b", *words]
        return subprocess.check_output(command, cwd=tmp_path, text=True, stderr=subprocess.DEVNULL).strip()

    for name in ("compare/a", "tmt/a", "mjcf/a", "pyproject.toml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    for words in (["init", "-q"], ["add", "-A"], ["commit", "-qm", "a"]):
        git(*words)
    (tmp_path / "notes.md").touch()
    assert provenance.commit() == git("rev-parse", "HEAD")
    (tmp_path / "tmt" / "b").touch()
    assert provenance.commit() != git("rev-parse", "HEAD")
    assert provenance.commit().startswith(git("rev-parse", "HEAD"))
