"""What is said of how a file is compared, and only where it is so; URDF files with meshes by packages and floating bases."""

import pytest
from files import mjcf

import compare
from compare.core.text import say
from compare.engines.mujoco import ModelError, read
from compare.engines.mujoco.parameters import remarks

BODY = '<body name="b"><joint name="j" axis="0 1 0"/><inertial pos="0.1 0 0" mass="1" diaginertia="1 1.5 2"/></body>'
INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
MESH = '<collision><geometry><mesh filename="{}"/></geometry></collision>'
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def urdf(base: str, kind: str = "continuous", inertial: str = "", mesh: str = "") -> str:
    links = f'<link name="{base}">{inertial}</link><link name="rod">{INERTIAL}{mesh}</link>'
    joint = f'<parent link="{base}"/><child link="rod"/><axis xyz="0 0 1"/>'
    return f'<robot name="r">{links}<joint name="j" type="{kind}">{joint}</joint></robot>'


def said(source) -> dict:
    """The values of each remark, by kind."""
    found = remarks(read(source), True)
    assert all(map(say, found))
    return {one.kind: one.values for one in found}


def test_what_is_off_or_changed_is_said_where_equations_differ_and_nothing_where_they_agree():
    text = mjcf(BODY.replace('name="b"', 'name="b" gravcomp="1"'))
    assert list(said(text)) == ["switched_off"] and said(mjcf(BODY)) == {}
    key = mjcf(BODY).replace("</mujoco>", '<keyframe><key name="k" qpos="nan"/></keyframe></mujoco>')
    assert [one.feature for one in said(key)["switched_off"]["features"]] == ["unusable keyframe"]
    total = said(mjcf(BODY, '<compiler settotalmass="3"/>'))
    assert total["changed"] == {"why": "settotalmass", "places": {"mass": ["b"], "inertia": ["b"]}}
    compare.assert_agrees(text, mass_matrix=[[[1.51]]], q=[[0.3]])
    with pytest.raises(AssertionError, match="gravcomp"):
        compare.assert_agrees(text, gravity=[[0.0]], q=[[0.3]])


@pytest.mark.parametrize("base, kind, inertial, joints, fixed", [
    ("trunk", "continuous", INERTIAL, 1, {"link": "trunk", "mass": 2.0}), ("trunk", "continuous", "", 1, None),
    ("world", "floating", INERTIAL, 4, None), ("trunk", "floating", "", 4, None), ("trunk", "planar", "", 3, None),
])  # fmt: skip
def test_a_base_is_free_if_a_joint_frees_it_else_it_is_said_to_be_fixed(
    base, kind, inertial, joints, fixed, tmp_path
):
    (tmp_path / "r.urdf").write_text(urdf(base, kind, inertial))
    assert len(read(tmp_path / "r.urdf").tree.joint_names) == joints
    assert said(tmp_path / "r.urdf").get("fixed_base") == fixed


@pytest.mark.parametrize("folder, place", [
    ("robot/urdf", "robot/meshes/a.obj"), (".", "robot/meshes/a.obj"), ("mine", "mine/a.obj"), ("robot/urdf", "a.obj"),
])  # fmt: skip
def test_a_mesh_of_a_package_is_found_above_the_file_or_beside_it_else_one_line_says_where_to(
    folder, place, tmp_path
):
    file = tmp_path / folder / "r.urdf"
    robot = urdf("base", mesh=MESH.format("package://robot/meshes/a.obj"))
    for path, text in ((file, robot), (tmp_path / place, TETRAHEDRON)):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    if place != "a.obj":
        assert read(file).model.nmesh == 1
        return
    with pytest.raises(ModelError, match=r"^[^\n]*NAME beside the file[^\n]*$"):
        read(file)
