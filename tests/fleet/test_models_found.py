"""Which files a fleet has: folders, patterns, files and lists, and what is left out with its reason."""

import os

import pytest

from compare.fleet.models import bundle, files_in, found_models, place_of_report
from compare.fleet.piece import FleetError

MODEL = "<mujoco><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>"


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder, and a function that writes files there by their names."""
    monkeypatch.chdir(tmp_path)

    def write(names, text=MODEL):
        for name in [names] if isinstance(names, str) else names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(text, encoding="utf-8")

    return write


def names(*asked):
    return [model.shown for model in found_models(asked).models]


def test_a_folder_gives_its_mjcf_at_any_depth_and_nothing_else(here):
    here(["m/a.xml", "m/b/c/d.XML", "m/e.mjcf", "m/.git/f.xml", "m/b/.g.xml", "m/mesh.obj", "m/folder.xml/h.xml"])
    here("m/robot.urdf.xml", "<robot name='x'/>")
    here("m/package.xml", "<?xml version='1.0'?><package/>")
    here("m/no.xml", "<!-- nothing -->")
    here("m/none.xml", "")
    here("m/words.xml", "alpha turns about y")
    (os.mkfifo if hasattr(os, "mkfifo") else os.mkdir)("m/pipe.xml")
    # what has no element at all is refused, and not passed over
    assert names("m") == ["m/a.xml", "m/b/c/d.XML", "m/e.mjcf", "m/folder.xml/h.xml", "m/none.xml", "m/words.xml"]
    assert found_models(["m"]).left_out == [
        ("m/no.xml", "it is no MJCF, it is no XML"),
        ("m/package.xml", "it is no MJCF, its outermost element is <package>"),
        ("m/robot.urdf.xml", "it is no MJCF, its outermost element is <robot>"),
    ]


def test_a_pattern_that_no_shell_expanded(here):
    here(["m/a.xml", "m/b/c.xml", "m/b/d/e.xml", "n/a[1].xml"])
    here("m/package.xml", "<package/>")
    assert names("m/*.xml") == ["m/a.xml"]
    assert names("m/**/*.xml") == ["m/a.xml", "m/b/c.xml", "m/b/d/e.xml"] == names("m/**")
    assert names("m/b*") == ["m/b/c.xml", "m/b/d/e.xml"]
    assert names("n/a[1].xml") == ["n/a[1].xml"]  # a file of that name comes before the pattern


def test_a_list_has_a_path_in_each_line(here):
    here(["m/a.xml", "m/b c.xml", "d.xml"])
    here("list.txt", "\ufeff# what is released\r\n\r\n  m/b c.xml  \r\n@list.txt\r\n@more/list.txt\r\n")
    here("more/list.txt", "d.xml\n@list.txt\n@more/list.txt\n")
    assert names("@list.txt") == ["d.xml", "m/b c.xml"] == names("@more/list.txt")
    assert names("@list.txt", "m", "./m/../m/a.xml") == ["d.xml", "m/a.xml", "m/b c.xml"]


@pytest.mark.parametrize("asked, says", [
    (["nowhere"], "there is no nowhere; a file, a folder, a pattern or @LIST is expected"),
    (["m/a.xml", "m/*.mjcf"], r"there is no m/\*.mjcf; "),
    (["m\n\0"], r"there is no m\\n\\x00; "),
    (["*\0"], r"there is no \*\\x00; "),
    (["@none.txt"], "cannot read the list none.txt: No such file"),
    (["@m"], "cannot read the list m: Is a directory"),
    (["@"], "cannot read the list "),
    (["empty", "@nothing.txt"], "no MJCF file is in empty, @nothing.txt"),
    (["@bad.txt"], "there is no m/c.xml; "),
    (["/dev/null"], "/dev/null is neither a file nor a folder"),
])  # fmt: skip
def test_a_word_that_names_nothing_is_refused_in_one_line(asked, says, here):
    here("m/a.xml")
    here("empty/package.xml", "<package/>")
    here("nothing.txt", "# nothing\n")
    here("bad.txt", "m/c.xml\n")
    with pytest.raises(FleetError, match=f"^{says}") as refused:
        found_models(asked)
    assert len(str(refused.value).splitlines()) == 1


def test_the_same_file_is_there_once_however_it_is_named(here, tmp_path):
    here(["m/a.xml", "m/b.xml"])
    assert names("m", "m/a.xml", "./m/../m/a.xml", str(tmp_path / "m" / "a.xml"), "m/*.xml") == ["m/a.xml", "m/b.xml"]
    (tmp_path / "m" / "0.xml").symlink_to("a.xml")
    (tmp_path / "m" / "dangling.xml").symlink_to("nowhere.xml")
    (tmp_path / "m" / "self").symlink_to(".")
    (tmp_path / "n").symlink_to("m")
    found = found_models(["m", "n"])
    assert [model.shown for model in found.models] == ["m/a.xml", "m/b.xml"]
    assert ("m/0.xml", "it is the same file as m/a.xml") in found.left_out
    assert all(why.startswith("it is the same file as m/") for _, why in found.left_out)


def test_parts_are_left_out_with_the_reason(here):
    here("scene.xml", "<mujoco><include file='robot.xml'/><include file='settings.xml'/></mujoco>")
    here("robot.xml")
    here(["settings.xml", "lonely.xml"], "<mujocoinclude><option timestep='0.001'/></mujocoinclude>")
    found = found_models(["."])
    assert {model.shown: model.included_by for model in found.models} == {"robot.xml": "scene.xml", "scene.xml": ""}
    assert found.left_out == [
        ("lonely.xml", "it is a part, to be included by a model"),
        ("settings.xml", "it is a part, included by scene.xml"),
    ]
    asked_for = found_models(["settings.xml", "scene.xml"])  # as a shell expands *.xml
    assert {model.shown: model.included_by for model in asked_for.models}["settings.xml"] == "scene.xml"


def test_a_part_that_is_named_is_a_model_also_where_its_folder_is_named_too(here):
    here("m/part.xml", "<mujocoinclude/>")
    for asked in (["m", "m/part.xml"], ["m/part.xml", "m"], ["./m/part.xml", "m/*", "m"]):
        (model,) = found_models(asked).models
        assert model.path.name == "part.xml" and found_models(asked).left_out == []


def test_a_file_that_may_not_be_read_is_a_model_so_that_it_is_refused_and_not_passed_over(here, monkeypatch):
    def refuses(*_, **__):
        raise PermissionError(13, "Permission denied")

    here("m/a.xml")
    monkeypatch.setattr("compare.fleet.models.ElementTree.iterparse", refuses)
    monkeypatch.setattr("compare.fleet.models.needed_by", lambda path: (path,))
    assert names("m") == ["m/a.xml"]


def test_of_files_that_include_each_other_none_is_a_part(here):
    here("a.xml", "<mujoco><include file='b.xml'/></mujoco>")
    here("b.xml", "<mujoco><include file='a.xml'/><include file='b.xml'/></mujoco>")
    assert [model.included_by for model in found_models(["."]).models] == ["", ""]


def test_broken_xml_is_a_model_if_it_seems_to_be_one_or_is_named(here):
    here("m/broken.xml", "<mujoco><worldbody>")
    here("m/other.xml", "<robot><link>")
    here("m/encoding.xml", "<?xml version='1.0' encoding='nonsense'?><mujoco/>")
    here("m/part.xml", "<mujocoinclude><body>")
    here("m/mesh.xml", "\0<mujoco>")
    assert names("m") == ["m/broken.xml", "m/encoding.xml"]
    assert names("m/other.xml", "m/mesh.xml") == ["m/mesh.xml", "m/other.xml"]


def test_a_folder_that_cannot_be_read_is_said(tmp_path):
    left_out = []
    assert list(files_in(tmp_path / "gone", left_out)) == []
    assert left_out == [(str(tmp_path / "gone"), "it cannot be read: No such file or directory")]


def test_a_file_that_is_gone_or_has_changed_is_not_sent(here):
    here(["a.xml", "b.xml"])
    first, second = found_models(["."]).models
    assert first.hash != second.hash  # of the same content: a name belongs to it
    here("a.xml", MODEL + "<!-- -->")
    with pytest.raises(OSError, match="has changed since the fleet began"):
        bundle(first)
    os.unlink("b.xml")
    assert second.hash
    with pytest.raises(FileNotFoundError):
        bundle(second)


def test_reports_of_two_files_are_never_in_one_folder(tmp_path):
    asked = ["a/b.xml", "/a/b.xml", "../a/b.xml", "../../a/b.xml", "a/../b.xml", "b.xml", "up/a/b.xml", "x" * 300 + ".xml",
             "x" * 301 + ".xml", "a/b.xml/c.xml", "ü/b.xml", "a/b.XML"]  # fmt: skip
    places = [place_of_report(shown) for shown in asked]
    assert (
        len({place.casefold() for place in places}) == len(asked) - 1
    )  # a/b.xml and a/b.XML are one file or two, as places
    assert places[0] == "files/a/b.xml" and places[5] == "files/b.xml"
    for place in places:
        whole = (tmp_path / place).resolve()
        assert whole.is_relative_to(tmp_path / "files") and all(len(part.encode()) < 250 for part in whole.parts)
    nested = [a for a in places for b in places if a != b and b.startswith(a + "/")]
    assert nested == [places[0]]  # of which the system has one only
