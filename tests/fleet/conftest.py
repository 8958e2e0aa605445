import os
from types import SimpleNamespace

import pytest
from inside import Inside

from compare.fleet.command import with_reference
from compare.fleet.file_pieces import Asked
from compare.fleet.kept import Kept
from compare.fleet.models import found_models
from compare.fleet.run import Run


@pytest.fixture
def fleet(tmp_path, monkeypatch):
    """fleet(files, names of experiments): a fleet of files in a folder, run to its end."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m").mkdir()

    def run(files, names=("mass",), door=None, found=None, is_quick=True, take=lambda run: None, reference=None):
        for name, text in files.items():
            (tmp_path / "m" / name).parent.mkdir(exist_ok=True)
            (tmp_path / "m" / name).write_text(text)
        kept, door = Kept(tmp_path / "out"), door or Inside()
        try:
            found = found or found_models(["m"])
            asked, sent = with_reference(Asked(tuple(names), is_quick), reference)
            of = Run(found.models, asked, door, kept, tmp_path / "out", sent)
            of.carry_out(lambda: take(of))
        finally:
            kept.close()
        return SimpleNamespace(of=of, door=door, rows={os.path.basename(row["file"]): row for row in of.rows})

    return run
