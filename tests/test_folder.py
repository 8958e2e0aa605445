"""A report takes the old one's place when it is complete, and nothing else is touched."""

import json

import pytest

from compare.folder import FolderError, new_report


def fill(work, text):
    """A small report that lists its files."""
    (work / "tables").mkdir()
    (work / "tables" / "mass.csv").write_text(text)
    listed = ["report.md", "results.json", "tables/mass.csv"]
    (work / "results.json").write_text(json.dumps({"provenance": {"files": listed}, "text": text}))


def files(folder):
    """What is in a folder; of results.json only the text of `fill`."""
    found = {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*") if p.is_file()}
    return {name: json.loads(text)["text"] if name == "results.json" else text for name, text in found.items()}


def test_a_new_report_replaces_the_old_one_and_keeps_other_files(tmp_path):
    out = tmp_path / "deep" / "report"
    with new_report(out) as work:
        fill(work, "old")
        (work / "report.md").write_text("only in the old one")
    (out / "my notes.txt").write_text("mine")
    with new_report(out) as work:
        fill(work, "new")
    assert files(out) == {"tables/mass.csv": "new", "results.json": "new", "my notes.txt": "mine"}
    assert sorted(p.name for p in out.iterdir()) == ["my notes.txt", "results.json", "tables"]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_an_interrupted_report_leaves_the_old_one_whole(tmp_path, error):
    with new_report(tmp_path) as work:
        fill(work, "old")
    with pytest.raises(error), new_report(tmp_path) as work:
        fill(work, "half")
        raise error
    assert files(tmp_path) == {"tables/mass.csv": "old", "results.json": "old"}


def test_an_interrupted_first_report_leaves_no_folder(tmp_path):
    with pytest.raises(RuntimeError), new_report(tmp_path / "new"):
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_an_exchange_that_fails_puts_everything_back(tmp_path, monkeypatch):
    with new_report(tmp_path) as work:
        fill(work, "old")
    rename = type(tmp_path).rename

    def stubborn(source, target):
        if ".new-" in str(source) and source.name == "tables":
            raise PermissionError(13, "Permission denied")
        return rename(source, target)

    with pytest.raises(FolderError, match="the old one is unchanged"), new_report(tmp_path) as work:
        fill(work, "new")
        monkeypatch.setattr(type(tmp_path), "rename", stubborn)
    monkeypatch.undo()
    assert files(tmp_path) == {"tables/mass.csv": "old", "results.json": "old"}


@pytest.mark.parametrize("report", [False, True])
def test_files_of_somebody_elses_are_not_replaced(tmp_path, report):
    if report:
        with new_report(tmp_path) as work:
            fill(work, "old")
    (tmp_path / "tables").mkdir(exist_ok=True)
    (tmp_path / "tables" / "precious.csv").write_text("1")
    before = files(tmp_path)
    with (
        pytest.raises(FolderError, match=r"has tables/precious\.csv, which is not of an earlier report"),
        new_report(tmp_path),
    ):
        pass
    assert files(tmp_path) == before


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"provenance": {"files": null}}'])
def test_some_other_results_json_is_not_replaced(tmp_path, text):
    (tmp_path / "results.json").write_text(text)
    with pytest.raises(FolderError, match=r"has results\.json, which is not"), new_report(tmp_path):
        pass
    assert (tmp_path / "results.json").read_text() == text


def test_a_file_is_not_a_folder(tmp_path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(FolderError, match="a folder that can be written is expected"), new_report(path):
            pass
