"""Whatever is said of another engine is confirmed by a script that asks that engine directly, and is said of no other engine."""

import mujoco
import numpy as np
import pytest
from files import STL, URDF

import tmt
from compare.engines import RECORDS
from compare.engines.outside import Outside
from compare.engines.outside.file import File, OtherJoints, Unread, Unwritten
from compare.experiments.engines import add_not_asked, names_of_free
from compare.experiments.engines.causes import OF_ENGINES, joints_lost
from compare.experiments.engines.readings import compare_numbers
from compare.experiments.engines.tables import EnginesResult
from compare.run.reference import compared_with

INERTIAL = '<inertial pos="{}" mass="1" diaginertia="0.02 0.03 0.04"/>'
ARM = f"""<mujoco model="m">{{}}<worldbody><body name="b">{{}}{INERTIAL.format("0.2 0 0")}</body></worldbody>{{}}</mujoco>"""
HINGE, SPHERE = '<joint name="j" axis="0 1 0"/>', '<geom type="sphere" size="0.1" pos="0 0 -1"/>'
OF_GEOMS = f'<mujoco model="m">{{}}<worldbody><body name="b">{HINGE}{SPHERE}</body></worldbody></mujoco>'
MESHES = f"""<mujoco model="m"><asset><mesh name="m" file="m.{{}}"/></asset><worldbody><body name="b">{HINGE}
<geom type="mesh" mesh="m"/></body></worldbody></mujoco>"""
SEVERAL = '<joint name="j" axis="0 1 0"/><joint name="k" axis="0 0 1" pos="0.3 0 0"/>'
ROOT = f"""<mujoco model="m"><worldbody><body name="root" pos="0 0.4 1"><body name="b">{HINGE}
{INERTIAL.format("0.2 0 0")}</body></body></worldbody></mujoco>"""
TURNED = f"""<mujoco model="m"><worldbody><body name="b" pos="0 0 1" quat="0.8 0 0.6 0"><joint name="f" type="free"/>
{INERTIAL.format("0.2 0 0")}</body></worldbody></mujoco>"""
SMALL = """<mujoco model="m"><worldbody><body name="b"><joint name="j" axis="0 1 0"/>
<inertial pos="0 0 0" mass="1e-3" diaginertia="1e-11 1e-11 1e-11"/></body></worldbody></mujoco>"""
DEFAULTS = """<default><joint damping="0.3" axis="0 1 0"/><default class="leg"><geom density="500"/></default></default>"""
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n"


def drake(path):
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    return plant


def pinocchio(path):
    import pinocchio

    return pinocchio.buildModelFromMJCF(str(path))


def newton(path):
    import newton

    builder = newton.ModelBuilder()
    builder.add_mjcf(str(path))
    return builder.finalize(device="cpu")


def drakes_body(path):
    """Where Drake has body b at the angles 0.7 and 0."""
    plant = drake(path)
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, [0.7, 0.0])
    return plant.GetBodyByName("b").EvalPoseInWorld(context).translation()


def newtons_body(path):
    """Where Newton has it, with the angle of the joint that is not at the body's origin."""
    import newton as nt

    model = newton(path)
    state, q = model.state(), np.array([0.7, 0.0][::-1], np.float32)
    model.joint_q.assign(q)
    nt.eval_fk(model, model.joint_q, model.joint_qd, state)
    return state.body_q.numpy()[0, :3]


def mujocos_body(path, angle=0):
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[angle] = 0.7
    mujoco.mj_kinematics(model, data)
    return data.xpos[1]


def placement(path):
    import pinocchio as pin

    model = pinocchio(path)
    data, q = model.createData(), pin.neutral(model)
    pin.forwardKinematics(model, data, q)
    return data.oMi[1].act(model.inertias[1].lever)


def compiled(field):
    return lambda path: np.ravel(getattr(mujoco.MjModel.from_xml_path(str(path)), field))[-3:]


def turn(path):
    placement = pinocchio(path).jointPlacements[1].rotation
    return placement @ placement.T


def masses(engine):
    """The masses of bodies that an engine has, largest first."""
    return {
        "drake": lambda path: drake(path).GetBodyByName("b").default_mass(),
        "pinocchio": lambda path: pinocchio(path).inertias[1].mass,
        "newton": lambda path: newton(path).body_mass.numpy()[0],
    }[engine]


def free_damping(path):
    joint = drake(path).GetJointByName("b")
    return max(joint.default_damping_vector())


DAMPER = ARM.format("", '<joint name="j" springdamper="0.1 1"/>', "")
MASS = compiled("body_mass")
ARMATURE = '<actuator><position joint="j" armature="0.4"/></actuator>'
BOX = '<geom type="box" size="0.1 0.05 0.02" {}/>'
FREE = f"""<mujoco model="m"><default><joint damping="0.3"/></default><worldbody><body name="b"><joint name="b" type="free"/>
{INERTIAL.format("0 0 0")}</body></worldbody></mujoco>"""
FRAME = f"""<mujoco model="m"><worldbody><body name="b">{HINGE}{INERTIAL.format("0.2 0 0")}<frame><body name="c">
<joint name="k"/>{INERTIAL.format("0.1 0 0")}</body></frame></body></worldbody></mujoco>"""
REPLICATE = f"""<mujoco model="m"><worldbody><body name="b">{HINGE}{INERTIAL.format("0.2 0 0")}</body><replicate count="1">
<body name="c"><joint name="k"/>{INERTIAL.format("0.1 0 0")}</body></replicate></worldbody></mujoco>"""
ROOTS = f"""<mujoco model="m"><worldbody><body name="b">{HINGE}{INERTIAL.format("0.2 0 0")}</body><body name="c">
<joint name="k"/>{INERTIAL.format("0.1 0 0")}</body></worldbody></mujoco>"""
OBLIQUE = ROOT.replace('pos="0 0.4 1"', "").replace('name="b"', 'name="b" axisangle="0 1 1 40"')
OPEN = MESHES.format("open.obj").replace('.open.obj"', '.open.obj" inertia="exact"')
CLASS = '<default><default class="c">{}</default></default>'
GRAVITY = ARM.format('<option gravity="1 2 -3"/>', HINGE, "")
NO_GRAVITY = ARM.format('<option><flag gravity="disable"/></option>', HINGE, "")
BOUNDS = OF_GEOMS.format('<compiler boundmass="9" boundinertia="1"/>')
RANGE = OF_GEOMS.format('<compiler inertiagrouprange="3 3"/>').replace(
    SPHERE, SPHERE + BOX.format('group="3"')
)
SHELL = OF_GEOMS.format("").replace(SPHERE, BOX.format('shellinertia="true"'))
# the kind of cause, the engine, the file; what the engine has, by itself, and what MuJoCo has: they differ
CASES = (
    ("class_without_joint", "drake", ARM.format(DEFAULTS, '<joint name="j" class="leg"/>', ""),
     lambda path: drake(path).GetJointByName("j").default_damping(), compiled("dof_damping")),
    ("no_springs", "drake", ARM.format("", '<joint name="j" stiffness="7"/>', ""),
     lambda path: float(drake(path).num_force_elements() - 1), lambda path: 1.0),
    ("springdamper", "drake", DAMPER, lambda path: drake(path).GetJointByName("j").default_damping(), compiled("dof_damping")),
    ("springdamper", "newton", DAMPER, lambda path: newton(path).joint_damping.numpy(), compiled("dof_damping")),
    ("armature_without_motor", "drake", ARM.format("", '<joint name="j" armature="0.1"/>', ""),
     lambda path: float(drake(path).num_actuators()), compiled("dof_armature")),
    ("armature_of_actuator", "drake", ARM.format("", HINGE, ARMATURE), lambda path: [
        drake(path).get_joint_actuator(index).default_reflected_inertia() for index in drake(path).GetJointActuatorIndices()],
     lambda path: 0.4),
    ("armature_of_actuator", "pinocchio", ARM.format("", HINGE, ARMATURE),
     lambda path: pinocchio(path).armature, lambda path: 0.4),
    ("armature_of_actuator", "newton", ARM.format("", HINGE, ARMATURE),
     lambda path: newton(path).joint_armature.numpy(), lambda path: 0.4),
    ("passive_of_free", "drake", FREE, free_damping, lambda path: 0.3),
    ("passive_of_free", "newton", FREE, lambda path: newton(path).joint_damping.numpy().max(), lambda path: 0.3),
    ("option_gravity", "newton", GRAVITY, lambda path: newton(path).gravity.numpy()[0], lambda path: [1.0, 2.0, -3.0]),
    ("option_gravity", "pinocchio", GRAVITY, lambda path: pinocchio(path).gravity.linear, lambda path: [1.0, 2.0, -3.0]),
    ("gravity_flag", "drake", NO_GRAVITY, lambda path: drake(path).gravity_field().gravity_vector(), lambda path: 0.0),
    ("gravity_flag", "pinocchio", NO_GRAVITY, lambda path: pinocchio(path).gravity.linear, lambda path: 0.0),
    *(("total_mass", engine, OF_GEOMS.format('<compiler settotalmass="14"/>'), masses(engine), lambda path: 14.0)
      for engine in ("drake", "pinocchio", "newton")),
    *(("bounds", engine, BOUNDS, masses(engine), lambda path: 9.0) for engine in ("drake", "pinocchio")),
    *(("groups", engine, RANGE, masses(engine), MASS) for engine in ("drake", "pinocchio")),
    *(("shell_inertia", engine, SHELL, masses(engine), MASS) for engine in ("drake", "newton")),
    ("joint_pos_of_class", "pinocchio", ARM.format(CLASS.format('<joint pos="0.5 0 0"/>'), '<joint name="j" class="c"/>', ""),
     lambda path: pinocchio(path).jointPlacements[1].translation, lambda path: [0.5, 0.0, 0.0]),
    ("geom_mass_of_class", "pinocchio", OF_GEOMS.format('<default><geom mass="0.1"/></default>'), masses("pinocchio"), MASS),
    ("geoms_without_contacts", "pinocchio", OF_GEOMS.format("").replace(
        SPHERE, SPHERE + BOX.format('contype="0" conaffinity="0"')), masses("pinocchio"), MASS),
    *(("mass_of_meshes", engine, text, masses(engine), MASS) for engine, text in (
        ("drake", OPEN.replace('inertia="exact"', 'inertia="shell"')), ("pinocchio", OPEN), ("newton", OPEN))),
    ("float32_meshes", "drake", MESHES.format("third.obj"), masses("drake"), MASS),
    ("small_inertia", "newton", SMALL, lambda path: newton(path).body_inertia.numpy()[0, 0, 0], lambda path: 1e-11),
    ("several_joints", "drake", ARM.format("", SEVERAL, "").replace("<body ", '<body pos="0 0 1" '), drakes_body, mujocos_body),
    ("several_joints", "newton", ARM.format("", SEVERAL, ""), newtons_body, lambda path: mujocos_body(path, 1)),
    ("fixed_root", "pinocchio", ROOT, placement, lambda path: [0.2, 0.4, 1.0]),
    ("turned_start", "pinocchio", TURNED, placement, lambda path: [0.2, 0.0, 0.0]),  # at q = 0
    ("oblique_turn", "pinocchio", OBLIQUE, turn, lambda path: np.eye(3)),
    *(("frame", engine, FRAME, speeds, lambda path: 2.0) for engine, speeds in (
        ("drake", lambda path: drake(path).num_velocities()), ("pinocchio", lambda path: pinocchio(path).nv))),
    ("other_roots", "pinocchio", ROOTS, lambda path: pinocchio(path).nv, lambda path: 2.0),
    *(("replicate", engine, REPLICATE, speeds, lambda path: 2.0) for engine, speeds in (
        ("drake", lambda path: drake(path).num_velocities()), ("newton", lambda path: newton(path).joint_dof_count))),
)  # fmt: skip


def file_of(folder, text):
    path = folder / "robot.xml"
    path.write_text(text)
    (folder / "m.obj").write_text(TETRAHEDRON)
    (folder / "m.third.obj").write_text(TETRAHEDRON.replace("1 0 0", "0.3 0 0"))
    (folder / "m.open.obj").write_text(TETRAHEDRON.replace("f 1 3 2\n", ""))
    (folder / "m.stl").write_bytes(STL)
    return path


def kinds_named(engine, path):
    """The kinds of causes that the program names for an engine."""
    robot, result = compared_with("model", str(path)).robot, EnginesResult("engines")
    result.tables["engines_read"] = []
    try:
        compare_numbers(result, robot, RECORDS[engine], Outside(engine).of(robot.case()).reading)
    except OtherJoints as error:
        add_not_asked(result, robot, engine, error)
    causes = [note.values["cause"] for note in result.notes if "cause" in note.values]
    return {cause.kind if cause else "" for cause in causes}


def skip_unless_installed(engine):
    if Outside(engine).unavailable():
        pytest.skip(f"{engine} is not installed")


@pytest.mark.parametrize(
    "kind, engine, text, ask, stated", CASES, ids=[f"{case[0]}-{case[1]}" for case in CASES]
)
def test_a_cause_is_confirmed_by_the_engine_itself(kind, engine, text, ask, stated, tmp_path):
    skip_unless_installed(engine)
    path = file_of(tmp_path, text)
    assert np.abs(np.subtract(ask(path), stated(path))).max() > 1e-10, "the engine reads it as MuJoCo does"
    assert kinds_named(engine, path) == {kind}


def test_a_urdf_has_none_of_these_causes(tmp_path):
    path = file_of(tmp_path, URDF).rename(tmp_path / "robot.urdf")
    assert joints_lost(RECORDS["pinocchio"], File(path, ("j",), ("hinge",)), 0) is None


def test_each_cause_that_an_engine_can_have_has_a_script():
    known = {(kind, label) for label, kinds in OF_ENGINES.items() for kind in kinds}
    assert known == {(kind, RECORDS[engine].label) for kind, engine, *_ in CASES}


@pytest.mark.parametrize("engine", ("drake", "pinocchio", "newton"))
def test_nothing_is_said_of_an_engine_that_reads_the_number_right(engine, tmp_path):
    """The same class with a <joint> of its own; a driven joint; one joint in each body."""
    skip_unless_installed(engine)
    defaults = DEFAULTS.replace('<geom density="500"/>', "<joint/>")
    motor = '<actuator><motor joint="j"/></actuator>'
    path = file_of(tmp_path, ARM.format(defaults, '<joint name="j" class="leg"/>', motor))
    assert kinds_named(engine, path) == set()


@pytest.mark.parametrize("engine, text, error", (
    ("drake", MESHES.format("stl"), RuntimeError), ("drake", ARM.format("", HINGE, "").replace(' model="m"', ""), RuntimeError),
    ("drake", ARM.format("", HINGE, ""), None),
))  # fmt: skip
def test_a_refusal_is_that_of_the_engine_and_not_credited_with_the_copy(engine, text, error, tmp_path):
    skip_unless_installed(engine)
    path = file_of(tmp_path, text)
    reading = Outside(engine).of(compared_with("model", str(path)).robot.case()).reading
    if error:
        with pytest.raises(error):
            drake(path)
        assert reading["copied"][0] == "Refused"
    else:
        drake(path)
        assert reading["copied"] is None


@pytest.mark.parametrize("engine", ("drake", "pinocchio", "newton"))
def test_masses_and_a_gravity_that_were_read_otherwise_are_set(engine, tmp_path):
    skip_unless_installed(engine)
    second = f'<body pos="0.3 0 0" euler="0 0 40"><joint name="k" axis="0 1 0"/>{SPHERE}</body>'
    stated = '<compiler settotalmass="9"/><option gravity="1 2 -3"/>'
    two = OF_GEOMS.format(stated).replace(f"{SPHERE}</body>", f"{SPHERE}{second}</body>")
    robot = compared_with("model", str(file_of(tmp_path, two))).robot
    of, q, v = Outside(engine).of(robot.case()), np.array([[0.4, -0.8]]), np.array([[1.0, 0.5]])
    mended = of.reading["mended"]
    assert {"mass", "moments"} <= mended.keys() and all(mended.values())
    assert "gravity" in mended or engine == "drake"
    share = 1e4 * RECORDS[engine].eps
    assert of.mass_matrix(q)[0] == pytest.approx(tmt.mass_matrix(q[0], robot.tree), rel=share)
    assert of.bias(q, v)[0] == pytest.approx(tmt.bias(q[0], v[0], robot.tree), rel=share)


def test_an_assertion_of_drake_is_a_refusal_and_does_not_end_the_program(tmp_path):
    skip_unless_installed("drake")
    massless = '<body name="c"><inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/></body></body>'
    path = file_of(tmp_path, ARM.format("", HINGE, "").replace("</body>", massless))
    with pytest.raises(SystemExit):
        drake(path)
    with pytest.raises(Unread, match="mass > 0"):
        Outside("drake").of(compared_with("model", str(path)).robot.case()).reading  # noqa: B018


def test_a_copy_of_a_file_with_includes_has_each_body_once(tmp_path):
    """Pinocchio refuses the file; it would read the first of two worlds twice."""
    skip_unless_installed("pinocchio")
    file_of(tmp_path, ARM.format("", HINGE, "")).rename(tmp_path / "part.xml")
    path = file_of(
        tmp_path, '<mujoco model="s"><include file="part.xml"/><worldbody><light/></worldbody></mujoco>'
    )
    with pytest.raises(RuntimeError):
        pinocchio(path)
    reading = Outside("pinocchio").of(compared_with("model", str(path)).robot.case()).reading
    assert reading["copied"][0] == "Refused" and not reading["mended"]


def test_what_warp_lacks_for_an_integrator_or_for_contacts_is_no_refusal(tmp_path):
    skip_unless_installed("warp")
    path = file_of(tmp_path, ARM.format('<option noslip_iterations="2"/>', HINGE, ""))
    assert not Outside("warp").of(compared_with("model", str(path)).robot.case()).reading["mended"]


def test_pinocchio_applies_the_armature_of_a_free_body_to_its_own_speeds(tmp_path):
    """Its acceleration is another one than MuJoCo's by the turn of the axes of its velocity, without armature the same."""
    skip_unless_installed("pinocchio")
    import pinocchio as pin

    for armature, is_same in (("0", True), ("0.5", False)):
        text = FREE.replace('damping="0.3"', f'armature="{armature}"').replace(
            ">", '><option gravity="0 0 0"/>', 1
        )
        path = file_of(tmp_path, text)
        model, of_mujoco = pinocchio(path), mujoco.MjModel.from_xml_path(str(path))
        model.gravity.linear[:] = 0.0
        data, v = (
            mujoco.MjData(of_mujoco),
            np.array([1.0, 2.0, 3.0, 0.4, 0.5, 0.6]),
        )  # its axes are the world's
        data.qvel[:] = v
        mujoco.mj_forward(of_mujoco, data)
        a = pin.aba(model, model.createData(), pin.neutral(model), v, np.zeros(6))
        moved = a[:3] + np.cross(v[3:], v[:3])
        assert np.allclose(moved, data.qacc[:3]) == is_same
        robot = compared_with("model", str(path)).robot
        assert names_of_free(robot) == [] if is_same else ["b"]


def test_pinocchio_has_no_springs_and_applies_no_damping(tmp_path):
    skip_unless_installed("pinocchio")
    import pinocchio as pin

    path = file_of(tmp_path, ARM.format("", '<joint name="j" axis="0 1 0" stiffness="9" damping="2"/>', ""))
    model, accelerations = pinocchio(path), []
    for damping in (0.0, 5.0):
        model.damping = np.array([damping])
        accelerations.append(pin.aba(model, model.createData(), *np.eye(3)[:, :1]))
    assert accelerations[0] == accelerations[1] and not any("stiffness" in name for name in dir(model))
    reading = Outside("pinocchio").of(compared_with("model", str(path)).robot.case()).reading
    assert reading["lacking"] == ("damping", "stiffness") and "stiffness" not in reading["read"]


def test_what_a_urdf_cannot_state_is_no_refusal_of_the_engine(tmp_path):
    """A ball, a joint beside a free base, and the armature of a free body."""
    skip_unless_installed("pybullet")
    beside = FREE.replace(
        "</worldbody>", f'<body name="c">{HINGE}{INERTIAL.format("0 0 1")}</body></worldbody>'
    )
    ball = ARM.format("", '<joint name="j" type="ball"/>', "")
    for text in (beside, ball, FREE.replace("damping", "armature")):
        robot = compared_with("model", str(file_of(tmp_path, text))).robot
        with pytest.raises(Unwritten):
            Outside("pybullet").of(robot.case()).reading  # noqa: B018
