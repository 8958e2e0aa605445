"""The file as it runs: MuJoCo in the engine's place, with one change, differs first in the field that this changes."""

import mujoco
import numpy as np
import pytest

from compare.engines import RECORDS
from compare.engines.outside import Outside, as_it_runs
from compare.engines.outside.as_it_runs import BEYOND, contacts_of, fields, run
from compare.engines.outside.file import File

# two hinges with dry friction, a servo, and a ball that falls on the floor and rolls
RUNNING = """<mujoco><option timestep="0.004" iterations="{}" ls_iterations="{}"/>
<default><joint damping="0.1"/></default><worldbody>
<geom name="floor" type="plane" size="1 1 0.1"/><body name="upper" pos="0 0 1">
<joint name="hip" axis="0 1 0" frictionloss="0.2" armature="0.01"/>
<geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="0.5" contype="0" conaffinity="0"/><body name="lower" pos="0.3 0 0">
<joint name="knee" axis="0 1 0" frictionloss="0.2"/><geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="0.4"
contype="0" conaffinity="0"/></body></body><body name="ball" pos="1 0 0.11">
<freejoint name="free"/><geom name="round" size="0.1" mass="0.3"/></body>
</worldbody><actuator><position joint="hip" kp="20" kv="1"/></actuator><keyframe>
<key qpos="0.3 0.5 1 0 0.11 1 0 0 0" qvel="0 0 0.3 0 0 0 0 0" ctrl="0.4"/></keyframe></mujoco>"""


class Mujoco(as_it_runs.Stepper):
    """MuJoCo itself, with a change of the model, or of the order of what it returns."""

    change = staticmethod(lambda model: None)
    is_reversed = False

    def __init__(self, file, model):
        self.model = mujoco.MjModel.__copy__(model)
        self.change(self.model)

    def put(self, data):
        copied = mujoco.MjData(self.model)
        mujoco.mj_copyState(self.model, data, copied, mujoco.mjtState.mjSTATE_INTEGRATION)
        return copied

    def step(self, data):
        mujoco.mj_step(self.model, data)
        return data

    def get(self, data):
        if self.is_reversed and data.nefc:
            for name in ("efc_aref", "efc_force"):
                getattr(data, name)[: data.nefc] = getattr(data, name)[: data.nefc][::-1].copy()
            rows = data.efc_J.reshape(-1, self.model.nv)[: data.nefc]
            rows[:] = rows[::-1].copy()
            pairs = [(contact.geom[::-1].copy(), contact.dist) for contact in data.contact]
            for contact, (geoms, distance) in zip(data.contact, pairs[::-1]):
                contact.geom, contact.dist = geoms, distance
        return data


def changed(change, **more):
    return type("Changed", (Mujoco,), {"change": staticmethod(change), **more})


@pytest.fixture
def file(tmp_path):
    def made(iterations=100, ls_iterations=50):
        path = tmp_path / "robot.xml"
        path.write_text(RUNNING.format(iterations, ls_iterations))
        return File(path, (), ())

    return made


CHANGES = {
    "xpos": lambda m: m.body_pos.__setitem__((2, 0), 0.3 + 1e-3),
    "M": lambda m: m.dof_armature.__setitem__(0, 0.02),
    "qfrc_bias": lambda m: m.opt.gravity.__setitem__(2, -9.8),
    "qfrc_passive": lambda m: m.jnt_stiffness.__setitem__((0, ...), 0.1),
    "qfrc_actuator": lambda m: m.actuator_gainprm.__setitem__((0, 0), 21.0),
    "contacts": lambda m: m.geom_contype.__setitem__(slice(None), 0),
    "dist": lambda m: m.geom_size.__setitem__((1, 0), 0.1 + 1e-4),
    "efc_J": lambda m: setattr(m.opt, "cone", mujoco.mjtCone.mjCONE_ELLIPTIC),
    "efc_aref": lambda m: m.geom_solref.__setitem__((slice(None), 0), 0.03),
    "efc_force": lambda m: m.dof_frictionloss.__setitem__(0, 0.19),
    "qvel after": lambda m: setattr(m.opt, "integrator", mujoco.mjtIntegrator.mjINT_IMPLICITFAST),
}


@pytest.mark.parametrize("field", CHANGES)
def test_the_first_other_field_is_that_which_a_change_of_the_model_changes_first(field, file):
    made = run(changed(CHANGES[field]), "float32", file())
    assert made.first.field == field and made.over > 1.0
    owner = {"xpos": "lower", "M": "hip", "qfrc_passive": "hip", "qfrc_actuator": "hip", "efc_force": "hip"}
    if field in owner:
        assert made.first.of == owner[field]


def test_the_same_model_has_the_same_fields_whatever_the_order_of_contacts_rows_and_pairs(file):
    """The ball lies on a mat, and in reach of the floor below it."""
    mat, running = '<geom name="mat" type="plane" size="1 1 0.1" pos="0 0 0.0005"/>', file()
    running.path.write_text(running.path.read_text().replace("<worldbody>", f"<worldbody>{mat}"))
    for kind in (Mujoco, changed(lambda m: None, is_reversed=True)):
        made = run(kind, "float64", running)
        assert made.first is None and made.over <= 1.0 and made.apart == {1: 0.0, 10: 0.0, 100: 0.0}


@pytest.mark.parametrize("precision", BEYOND)
@pytest.mark.parametrize("share, differs", ((0.9, False), (1.1, True)))
def test_a_field_just_inside_and_just_outside_of_its_precision(precision, share, differs, file):
    """Of its largest entry: of the damping, of which the speed of one joint is the largest at each step."""
    by = 1.0 + share * BEYOND[precision]
    made = run(changed(lambda m: m.dof_damping.__imul__(by)), precision, file())
    assert (made.first is not None and made.first.field == "qfrc_passive") == differs


@pytest.mark.parametrize("integrator, differs", (("RK4", False), ("Euler", True)))
def test_the_mean_of_stages_in_qacc_is_no_difference(integrator, differs, file):
    """An engine that leaves the acceleration of another stage there, with the right motion."""

    class LastStage(Mujoco):
        def step(self, data):
            super().step(data)
            data.qacc[:] *= 1.5
            return data

    path = file().path
    path.write_text(path.read_text().replace("<option", f'<option integrator="{integrator}"'))
    made = run(LastStage, "float32", File(path, (), ()))
    assert (made.first is not None) == differs and (not differs or made.first.field == "qacc")


def test_a_difference_of_the_size_of_rounding_is_none_where_a_contact_makes_much_of_it(file):
    """An engine whose positions are rounded to single precision: a ball rests on the floor."""

    class Single(Mujoco):
        def put(self, data):
            copied = super().put(data)
            copied.qpos[:] = copied.qpos.astype(np.float32)
            return copied

    path = file().path
    resting = path.read_text().replace("1 0 0.11 1 0 0 0", "1 0 0.09999 1 0 0 0")
    path.write_text(resting.replace("0.3 0 0 0 0 0", "0 0 0 0 0 0"))
    made = run(Single, "float32", File(path, (), ()))
    assert made.first is None and made.over <= 1.0 and made.largest["dist"] > 1e-4


def test_what_a_solver_has_not_converged_to_goes_with_more_iterations(file):
    """A warm start that is lost: another force of friction after one iteration, the same one after more."""

    class Cold(Mujoco):
        def put(self, data):
            copied = super().put(data)
            copied.qacc_warmstart[:] = 0.0
            return copied

    first, last = (run(Cold, "float32", file(1, 1), iterations) for iterations in (None, 100))
    assert (first.iterations, first.ls_iterations, first.first.field) == (1, 1, "efc_force")
    assert (last.iterations, last.ls_iterations, last.first) == (100, 50, None)


def test_free_runs_begin_at_the_first_keyframe_with_its_controls(file):
    """How far apart they are is what a script with plain MuJoCo finds."""
    made = run(changed(CHANGES["qfrc_actuator"]), "float32", file())
    ends = []
    for gain in (20.0, 21.0):
        m = mujoco.MjModel.from_xml_string(RUNNING.format(100, 50))
        m.actuator_gainprm[0, 0] = gain
        d = mujoco.MjData(m)
        mujoco.mj_resetDataKeyframe(m, d, 0)
        for _ in range(100):
            mujoco.mj_step(m, d)
        ends.append(d.qpos.copy())
    assert made.apart[100] == pytest.approx(np.abs(ends[1] - ends[0]).max(), rel=1e-3)


def test_contacts_that_do_not_act_are_none(file):
    m = mujoco.MjModel.from_xml_path(str(file().path))
    m.geom_gap[:] = 1.0
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, 0)
    mujoco.mj_forward(m, d)
    assert d.ncon and not list(contacts_of(d)) and not fields(m, d)["contacts"].size


ENGINES = [name for name in ("mjx_float32", "warp", "newton") if not Outside(name).unavailable()]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_an_engine_runs_a_file_nearly_as_mujoco_does_once_its_solver_has_converged(engine, file):
    """MJX leaves 1e-3 of an acceleration where friction holds; all have the step and the integrator of the file."""
    from compare.engines.outside import answers
    from compare.run.reference import compared_with

    path = file(1, 2).path
    of = Outside(engine).of(compared_with("model", str(path)).robot.case())
    first, last = (of.ask(answers.run_as_it_is, iterations) for iterations in (None, 100))
    assert first.first.field == "efc_force" and last.over < 1e-2 * first.over
    same = CHANGES.keys() - {"qvel after"} | {"qacc_smooth"}
    assert max(last.largest[name] for name in same) < BEYOND["float32"]
    assert last.apart[100] < 1e-4
    assert RECORDS[engine].precision == "float32"


def test_a_model_that_an_engine_has_made_has_the_same_joints_and_gets_the_state_of_mujocos(file):
    text = RUNNING.format(100, 50)
    m, other = map(mujoco.MjModel.from_xml_string, (text, text.replace('size="0.1"', 'size="0.2"')))
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, 0)
    mujoco.mj_step(m, d)
    as_it_runs.require_same(other, m)
    data = as_it_runs.copied(other, d)
    for name in ("qpos", "qvel", "ctrl", "qacc_warmstart"):
        assert np.array_equal(getattr(data, name), getattr(d, name)) and getattr(d, name).any()
    undriven = text.replace('<position joint="hip" kp="20" kv="1"/>', "").replace(' ctrl="0.4"', "")
    for why, other in (
        ("jnt_type", text.replace('<joint name="knee"', '<joint type="slide" name="knee"')), ("nu is 0", undriven)
    ):  # fmt: skip
        with pytest.raises(ValueError, match=why):
            as_it_runs.require_same(mujoco.MjModel.from_xml_string(other), m)
