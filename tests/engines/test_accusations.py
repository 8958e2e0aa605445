"""Whatever is said of another engine is confirmed by a script that asks that engine directly, and is said of no other engine."""

import mujoco
import numpy as np
import pytest
from files import STL

import tmt
from compare.engines import RECORDS
from compare.engines.outside import Outside
from compare.experiments.engines.causes import CAUSES
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


# the kind of cause, the engine, the file; what the engine has, by itself, and what MuJoCo has: they differ
CASES = (
    ("class_without_joint", "drake", ARM.format(DEFAULTS, '<joint name="j" class="leg"/>', ""),
     lambda path: drake(path).GetJointByName("j").default_damping(), compiled("dof_damping")),
    ("no_springs", "drake", ARM.format("", '<joint name="j" stiffness="7"/>', ""),
     lambda path: float(drake(path).num_force_elements() - 1), lambda path: 1.0),
    ("mass_of_geoms", "pinocchio", OF_GEOMS.format('<default><geom mass="0.1"/></default>'),
     lambda path: pinocchio(path).inertias[1].mass, lambda path: 0.1),
    ("armature_without_motor", "drake", ARM.format("", '<joint name="j" armature="0.1"/>', ""),
     lambda path: float(drake(path).num_actuators()), compiled("dof_armature")),
    ("option_gravity", "newton", ARM.format('<option gravity="1 2 -3"/>', HINGE, ""),
     lambda path: newton(path).gravity.numpy()[0], lambda path: [1.0, 2.0, -3.0]),
    ("option_gravity", "pinocchio", ARM.format('<option gravity="1 2 -3"/>', HINGE, ""),
     lambda path: pinocchio(path).gravity.linear, lambda path: [1.0, 2.0, -3.0]),
    *(("total_mass", engine, OF_GEOMS.format('<compiler settotalmass="14"/>'), ask, lambda path: 14.0) for engine, ask in (
        ("drake", lambda path: drake(path).GetBodyByName("b").default_mass()),
        ("pinocchio", lambda path: pinocchio(path).inertias[1].mass),
        ("newton", lambda path: newton(path).body_mass.numpy()[0]))),
    ("mass_of_meshes", "pinocchio", MESHES.format("obj"), lambda path: pinocchio(path).inertias[1].mass, compiled("body_mass")),
    ("mass_without_contacts", "pinocchio", OF_GEOMS.format('<default><geom contype="0" conaffinity="0"/></default>'),
     lambda path: pinocchio(path).inertias[1].mass, lambda path: mujoco.MjModel.from_xml_path(str(path)).body_mass[1]),
    ("small_inertia", "newton", SMALL, lambda path: newton(path).body_inertia.numpy()[0, 0, 0], lambda path: 1e-11),
    ("several_joints", "drake", ARM.format("", SEVERAL, "").replace("<body ", '<body pos="0 0 1" '), drakes_body, mujocos_body),
    ("several_joints", "newton", ARM.format("", SEVERAL, ""), newtons_body, lambda path: mujocos_body(path, 1)),
    ("fixed_root", "pinocchio", ROOT, placement, lambda path: [0.2, 0.4, 1.0]),
    ("turned_start", "pinocchio", TURNED, placement, lambda path: [0.2, 0.0, 0.0]),  # at q = 0
)  # fmt: skip


def file_of(folder, text):
    path = folder / "robot.xml"
    path.write_text(text)
    (folder / "m.obj").write_text(TETRAHEDRON)
    (folder / "m.stl").write_bytes(STL)
    return path


def kinds_named(engine, path):
    """The kinds of causes that the program names for an engine."""
    robot, result = compared_with("model", str(path)).robot, EnginesResult("engines")
    result.tables["engines_read"] = []
    compare_numbers(result, robot, RECORDS[engine], Outside(engine).of(robot.case()).reading)
    causes = [note.values["cause"] for note in result.notes if note.kind == "cause"]
    return {cause.kind for cause in causes if cause}


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
    assert kind in kinds_named(engine, path)


def test_each_cause_has_a_script():
    assert {find.__name__ for find in CAUSES} == {kind for kind, *_ in CASES}


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
