"""What a user's own code prints has an end, and does not change where the report is."""

import os

import pytest
from helpers import own_equations

from compare.__main__ import main
from compare.process import streams
from compare.process.streams import Capped, say_error


@pytest.mark.parametrize("more", [0, 1])
def test_so_much_is_printed_and_no_more(more, capsys, monkeypatch):
    monkeypatch.setattr(Capped, "printed", 0)
    stream = Capped()
    for text in ("a" * (streams.MOST_PRINTED - 1), "b" * (1 + more), "c" * more):
        stream.write(text)
    monkeypatch.setattr("sys.stderr", stream)
    say_error("what the program says")
    shown = capsys.readouterr().err.splitlines()
    assert shown[0].removesuffix(f"{streams.PROGRAM}: what the program says")[-2:] == "ab"
    assert [len(line) for line in shown[: 1 + more]][:more] == [streams.MOST_PRINTED] * more
    assert ("no more is shown" in "".join(shown)) == bool(more) and "c" not in shown[0][
        : streams.MOST_PRINTED
    ]
    assert shown[-1].endswith("what the program says")


def test_own_equations_that_change_the_folder_have_their_report_where_it_was_asked_for(
    inside, tmp_path, monkeypatch
):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "double.xml").write_text(own_equations.XML)
    lines = "import os", "from helpers.own_equations import bias, mass_matrix", "os.chdir('elsewhere')"
    (tmp_path / "moves.py").write_text("\n".join(lines))
    monkeypatch.chdir(tmp_path)
    assert main(["mass", "--quick", "--mjcf", "double.xml", "--reference", "moves.py:", "--out", "out"]) == 0
    assert os.getcwd() == str(tmp_path / "elsewhere") and os.listdir() == []
    assert (tmp_path / "out" / "index.html").exists()
