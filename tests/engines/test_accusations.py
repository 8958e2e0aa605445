"""Whatever is said of another engine is confirmed by a script that asks that engine directly, and is said of no other engine."""

import mujoco
import numpy as np
import pytest
from helpers.files import STL

import tmt
from compare.engines import RECORDS
from compare.engines.outside import Outside
from compare.engines.outside.file import OtherJoints, Unread
from compare.experiments.engines.features import FEATURES, feature_of_speeds
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
CLASS = '<default><default class="c">{}</default></default>'
GRAVITY = ARM.format('<option gravity="1 2 -3"/>', HINGE, "")
NO_GRAVITY = ARM.format('<option><flag gravity="disable"/></option>', HINGE, "")
BOUNDS = OF_GEOMS.format('<compiler boundmass="9" boundinertia="1"/>')
GROUPS = OF_GEOMS.format('<compiler inertiagrouprange="3 3"/>')
RANGE = GROUPS.replace(SPHERE, SPHERE + BOX.format('group="3"'))
SHELL = OF_GEOMS.format("").replace(SPHERE, BOX.format('shellinertia="true"'))
# the kind of cause, the engine, the file; what the engine has, by itself, and what MuJoCo has: they differ
CASES = (
    ("classes around one without <joint>", "drake", ARM.format(DEFAULTS, '<joint name="j" class="leg"/>', ""),
     lambda path: drake(path).GetJointByName("j").default_damping(), compiled("dof_damping")),
    ("stiffness of joints", "drake", ARM.format("", '<joint name="j" stiffness="7"/>', ""),
     lambda path: float(drake(path).num_force_elements() - 1), lambda path: 1.0),
    ("springdamper of joints", "drake",
     DAMPER, lambda path: drake(path).GetJointByName("j").default_damping(), compiled("dof_damping")),
    ("springdamper of joints", "newton", DAMPER, lambda path: newton(path).joint_damping.numpy(), compiled("dof_damping")),
    ("armature of joints that no motor or position actuator drives", "drake",
     ARM.format("", '<joint name="j" armature="0.1"/>', ""),
     lambda path: float(drake(path).num_actuators()), compiled("dof_armature")),
    ("armature of actuators", "drake", ARM.format("", HINGE, ARMATURE), lambda path: [
        drake(path).get_joint_actuator(index).default_reflected_inertia() for index in drake(path).GetJointActuatorIndices()],
     lambda path: 0.4),
    ("armature of actuators", "pinocchio", ARM.format("", HINGE, ARMATURE),
     lambda path: pinocchio(path).armature, lambda path: 0.4),
    ("armature of actuators", "newton", ARM.format("", HINGE, ARMATURE),
     lambda path: newton(path).joint_armature.numpy(), lambda path: 0.4),
    ("damping, armature and stiffness of free joints", "drake", FREE, free_damping, lambda path: 0.3),
    ("damping, armature and stiffness of free joints", "newton",
     FREE, lambda path: newton(path).joint_damping.numpy().max(), lambda path: 0.3),
    ("gravity of <option>", "newton", GRAVITY, lambda path: newton(path).gravity.numpy()[0], lambda path: [1.0, 2.0, -3.0]),
    ("gravity of <option>", "pinocchio",
     GRAVITY, lambda path: pinocchio(path).gravity.linear, lambda path: [1.0, 2.0, -3.0]),
    ("flag that disables gravity", "drake",
     NO_GRAVITY, lambda path: drake(path).gravity_field().gravity_vector(), lambda path: 0.0),
    ("flag that disables gravity", "pinocchio", NO_GRAVITY, lambda path: pinocchio(path).gravity.linear, lambda path: 0.0),
    *(("settotalmass of <compiler>", engine, OF_GEOMS.format('<compiler settotalmass="14"/>'), masses(engine), lambda path: 14.0)
      for engine in ("drake", "pinocchio", "newton")),
    *(("boundmass and boundinertia of <compiler>", engine,
       BOUNDS, masses(engine), lambda path: 9.0) for engine in ("drake", "pinocchio")),
    *(("inertiagrouprange of <compiler>", engine, RANGE, masses(engine), MASS) for engine in ("drake", "pinocchio")),
    *(("shellinertia of geoms", engine, SHELL, masses(engine), MASS) for engine in ("drake", "newton")),
    ("pos of joints in default classes", "pinocchio",
     ARM.format(CLASS.format('<joint pos="0.5 0 0"/>'), '<joint name="j" class="c"/>', ""),
     lambda path: pinocchio(path).jointPlacements[1].translation, lambda path: [0.5, 0.0, 0.0]),
    ("mass of geoms in default classes", "pinocchio",
     OF_GEOMS.format('<default><geom mass="0.1"/></default>'), masses("pinocchio"), MASS),
    ("geoms that touch nothing", "pinocchio", OF_GEOMS.format("").replace(
        SPHERE, SPHERE + BOX.format('contype="0" conaffinity="0"')), masses("pinocchio"), MASS),
    ("pose of a body for all of its joints but the last", "drake",
     ARM.format("", SEVERAL, "").replace("<body ", '<body pos="0 0 1" '), drakes_body, mujocos_body),
    ("pos of the joints of a body but that of the first", "newton",
     ARM.format("", SEVERAL, ""), newtons_body, lambda path: mujocos_body(path, 1)),
    ("pose of bodies on the world without a joint", "pinocchio", ROOT, placement, lambda path: [0.2, 0.4, 1.0]),
    *(("<frame> and <replicate>, with all that is in them", engine, FRAME, speeds, lambda path: 2.0) for engine, speeds in (
        ("drake", lambda path: drake(path).num_velocities()), ("pinocchio", lambda path: pinocchio(path).nv))),
    ("bodies on the world but the first", "pinocchio", ROOTS, lambda path: pinocchio(path).nv, lambda path: 2.0),
    *(("<frame> and <replicate>, with all that is in them", engine, REPLICATE, speeds, lambda path: 2.0) for engine, speeds in (
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


def features_named(engine, path):
    """The features without which MuJoCo has what an engine has read."""
    robot, result = compared_with("model", str(path)).robot, EnginesResult("engines")
    of, result.tables["engines_read"] = Outside(engine).of(robot.case()), []
    try:
        compare_numbers(result, robot, RECORDS[engine], of.file, of.reading)
    except OtherJoints as error:
        return {feature_of_speeds(of.file, error.speeds)}
    return {row.cause for row in result.tables["engines_read"] if row.compared is not None}


def skip_unless_installed(engine):
    if Outside(engine).unavailable():
        pytest.skip(f"{engine} is not installed")


@pytest.mark.parametrize("kind, engine, text, ask, stated", CASES, ids=[f"{a}-{b}" for a, b, *_ in CASES])
def test_a_cause_is_confirmed_by_the_engine_itself(kind, engine, text, ask, stated, tmp_path):
    skip_unless_installed(engine)
    path = file_of(tmp_path, text)
    assert np.abs(np.subtract(ask(path), stated(path))).max() > 1e-10, "the engine reads it as MuJoCo does"
    assert features_named(engine, path) == {kind}


def test_each_feature_but_those_that_were_never_lost_has_a_script():
    never = {"ref of joints that share a body", "damping of joints", "armature of joints"}
    never.add("density of geoms in default classes")
    assert FEATURES.keys() - never == {kind for kind, *_ in CASES}


@pytest.mark.parametrize("engine", ("drake", "pinocchio", "newton"))
def test_nothing_is_said_of_an_engine_that_reads_the_number_right(engine, tmp_path):
    """The same class with a <joint> of its own; a driven joint; one joint in each body."""
    skip_unless_installed(engine)
    defaults = DEFAULTS.replace('<geom density="500"/>', "<joint/>")
    motor = '<actuator><motor joint="j"/></actuator>'
    path = file_of(tmp_path, ARM.format(defaults, '<joint name="j" class="leg"/>', motor))
    assert features_named(engine, path) == set()


@pytest.mark.parametrize("engine", ("drake", "pinocchio", "newton"))
def test_masses_and_a_gravity_that_were_read_otherwise_are_set(engine, tmp_path):
    skip_unless_installed(engine)
    second = f'<body pos="0.3 0 0" euler="0 0 40"><joint name="k" axis="0 1 0"/>{SPHERE}</body>'
    stated = '<compiler settotalmass="9"/><option gravity="1 2 -3"/>'
    two = OF_GEOMS.format(stated).replace(f"{SPHERE}</body>", f"{SPHERE}{second}</body>")
    robot = compared_with("model", str(file_of(tmp_path, two))).robot
    of, q, v = Outside(engine).of(robot.case()), np.array([[0.4, -0.8]]), np.array([[1.0, 0.5]])
    assert {"mass", "inertia"} <= {*of.reading.differing} and not of.reading.not_set
    assert "gravity" in of.reading.differing or engine == "drake"
    share = 1e4 * RECORDS[engine].eps
    assert of.mass_matrix(q)[0] == pytest.approx(tmt.mass_matrix(robot.tree, q[0]), rel=share)
    assert of.bias(q, v)[0] == pytest.approx(tmt.bias(robot.tree, q[0], v[0]), rel=share)


def test_an_assertion_of_drake_is_a_refusal_and_does_not_end_the_program(tmp_path):
    skip_unless_installed("drake")
    massless = '<body name="c"><inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/></body></body>'
    path = file_of(tmp_path, ARM.format("", HINGE, "").replace("</body>", massless))
    with pytest.raises(SystemExit):
        drake(path)
    with pytest.raises(Unread, match="mass > 0"):
        Outside("drake").of(compared_with("model", str(path)).robot.case()).reading  # noqa: B018


def test_what_warp_lacks_for_an_integrator_or_for_contacts_is_no_refusal(tmp_path):
    skip_unless_installed("warp")
    path = file_of(tmp_path, ARM.format('<option noslip_iterations="2"/>', HINGE, ""))
    assert not Outside("warp").of(compared_with("model", str(path)).robot.case()).reading.differing


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
    assert reading.lacking == ("damping", "stiffness") and not {"damping", "stiffness"} & reading.read.keys()
