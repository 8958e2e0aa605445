"""Files that cannot be compared: each is refused with one line that names the element."""

from functools import cache

import mujoco
import numpy as np

from .names import joint_name, kind_of, own_name
from .source import MOVING_FIELDS

PLAIN = """<mujoco><worldbody><body><freejoint/><geom size="0.1"/>
<body><joint/><geom size="0.1"/><body><joint type="ball"/><geom size="0.1"/></body></body>
</body></worldbody></mujoco>"""
FIELDS = {  # numbers of each kind of element that must be finite
    "body": {
        "pos": "body_pos",
        "quat": "body_quat",
        "mass": "body_mass",
        "inertia": "body_inertia",
        "inertial pos": "body_ipos",
        "inertial quat": "body_iquat",
    },
    "joint": {
        "pos": "jnt_pos",
        "axis": "jnt_axis",
        "stiffness": "jnt_stiffness",
        "armature": "dof_armature",
        "damping": "dof_damping",
    },
    "actuator": {"gain": "actuator_gainprm", "bias": "actuator_biasprm", "gear": "actuator_gear"},
    "tendon": {"stiffness": "tendon_stiffness", "damping": "tendon_damping"},
}
NOT_NEGATIVE = ("jnt_stiffness", "dof_armature", "dof_damping")


def refuse(m: mujoco.MjModel) -> None:
    """ValueError, in one line, for a model that has forces, elements or numbers that cannot be compared."""
    for name in dir(mujoco):
        if name.startswith("get_mjcb_") and getattr(mujoco, name)() is not None:
            raise ValueError(f"the callback {name.removeprefix('get_')} is set; its forces are unknown")
    if not m.njnt:
        raise ValueError("it has no joint")
    if m.nflex:
        name = mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_FLEX, 0)
        raise ValueError(f"flex {name!r} is deformable; only rigid bodies are compared")
    for body in np.flatnonzero(m.body_plugin >= 0):
        raise ValueError(f"a plugin acts on body {element_name(m, 'body', body)!r}; its forces are unknown")
    for tendon in np.flatnonzero(m.tendon_armature):
        name = element_name(m, "tendon", tendon)
        raise ValueError(f"tendon {name!r} has armature, which couples joints; only armature at joints is compared")
    if unknown := unknown_part(m):
        raise ValueError(f"it uses {unknown}, which this version of compare does not support")
    refuse_values(m)


def refuse_values(m: mujoco.MjModel) -> None:
    """ValueError, in one line, for a number that is not finite, or negative where it must not be."""
    for kind, fields in FIELDS.items():
        for word, field in fields.items():
            values = np.asarray(getattr(m, field))
            values = values.reshape(len(values), -1 if values.size else 0)
            wrong = ~np.isfinite(values) | ((values < 0.0) & (field in NOT_NEGATIVE))
            for i in np.flatnonzero(wrong.any(axis=1)):
                name = element_name(m, kind, m.dof_jntid[i] if field.startswith("dof_") else i)
                shown = " ".join(f"{value:g}" for value in values[i]) if values.shape[1] < 5 else "not finite"
                expected = "a finite number of at least 0" if field in NOT_NEGATIVE else "finite numbers"
                raise ValueError(f"{word} of {kind} {name!r} is {shown}; expected {expected}")
    keys = [(f"keyframe {element_name(m, 'key', k)!r}", k) for k in range(m.nkey)]
    for word, values in (
        ("gravity", m.opt.gravity),
        ("the reference position", m.qpos0),
        ("the rest position of springs", m.qpos_spring),
        *((name, m.key_qpos[k]) for name, k in keys),
        *((f"the control of {name}", m.key_ctrl[k]) for name, k in keys),
    ):
        if not np.isfinite(values).all():
            raise ValueError(f"{word} is not finite")


def element_name(m: mujoco.MjModel, kind: str, number: int) -> str:
    if kind == "joint":
        return joint_name(m, int(number))
    return own_name(getattr(m, kind)(int(number)).name, kind, int(number))


def unknown_part(m: mujoco.MjModel) -> str:
    """The first flag, joint type, count, option or field in use that is not listed below; "" if all are listed.

    A field that the compiler fills in for any model is not in use: one that is zero in a plain model and not in this one is.
    """
    plain = plain_model()
    for flags, known, enum, prefix in (
        (m.opt.enableflags, KNOWN_ENABLING, mujoco.mjtEnableBit, "mjENBL_"),
        (m.opt.disableflags, KNOWN_DISABLING, mujoco.mjtDisableBit, "mjDSBL_"),
    ):
        for member, value in enum.__members__.items():
            name = member.removeprefix(prefix)
            if member != name and name not in known and flags & int(value):
                return f"the flag {name.lower()}"
    for number in range(m.njnt):
        if (kind := kind_of(m, number)) not in ("hinge", "slide", "ball", "free"):
            return f"a joint of type {kind}"
    for name in attributes(m):
        is_count = name.startswith("n") and isinstance(getattr(m, name), int)
        if is_count and name not in KNOWN_COUNTS and getattr(m, name) and not getattr(plain, name):
            return name
    for name in attributes(m.opt):
        if name not in KNOWN_OPTIONS and not np.array_equal(getattr(m.opt, name), getattr(plain.opt, name)):
            return f"the option {name}"
    for name in attributes(m):
        if name.startswith(MOVING_FIELDS) and name not in KNOWN_FIELDS and in_use(m, name) and not in_use(plain, name):
            return name
    return ""


def in_use(m: mujoco.MjModel, name: str) -> bool:
    """Whether a field of floats is not zero throughout, or one of integers has one above zero (-1 means none)."""
    values = np.asarray(getattr(m, name))
    return bool(np.any(values) if values.dtype.kind == "f" else np.any(values > 0))


def attributes(structure) -> list[str]:
    return [name for name in dir(structure) if not name.startswith("_") and not callable(getattr(structure, name))]


@cache
def plain_model() -> mujoco.MjModel:
    """A model with a joint of every type and nothing else."""
    return mujoco.MjModel.from_xml_string(PLAIN)


# what models have from MuJoCo 3.10 to 4.0.0, with which the reader was checked


def word_set(text: str, prefix: str = "") -> frozenset[str]:
    return frozenset(prefix + word for word in text.split())


KNOWN_COUNTS = word_set("""
nB nC nD nJfe nJfv nJmom nJten nM na nactuator narena nbody nbuffer nbvh nbvhdynamic nbvhstatic ncam nconmax nefm0L
nefm0dof nefmCvert nemax neq nexclude nflex nflexbending nflexedge nflexelem nflexelemdata nflexelemedge nflexevpair
nflexnode nflexshelldata nflexstiffness nflextexcoord nflexvert ngeom ngravcomp nhfield nhfielddata nhistory njmax njnt
nkey nlight nmat nmesh nmeshdegmax nmeshface nmeshgraph nmeshnormal nmeshpoly nmeshpolymap nmeshpolyvert nmeshtexcoord
nmeshvert nmocap nnames nnames_map nnumeric nnumericdata noct nout npair npaths nplastic nplugin npluginattr
npluginstate npolygonmax nq nsensor nsensordata nsite nskin nskinbone nskinbonevert nskinface nskintexvert nskinvert
ntendon ntex ntexdata ntext ntextdata ntree ntuple ntupledata nu nuser_actuator nuser_body nuser_cam nuser_geom
nuser_jnt nuser_sensor nuser_site nuser_tendon nuserdata nv nwrap
""")
KNOWN_OPTIONS = word_set("""
ccd_iterations ccd_tolerance cone density disableactuator disableflags enableflags gravity impratio integrator
iterations jacobian ls_iterations ls_tolerance magnetic noslip_iterations noslip_tolerance o_friction o_margin o_solimp
o_solref sdf_initpoints sdf_iterations sleep_tolerance solver timestep tolerance viscosity wind
""")
KNOWN_DISABLING = word_set("""
ACTUATION AUTORESET CLAMPCTRL CONSTRAINT CONTACT DAMPER EQUALITY EULERDAMP FILTERPARENT FRICTIONLOSS GRAVITY ISLAND
LIMIT MIDPHASE MULTICCD NATIVECCD REFSAFE SENSOR SPRING WARMSTART
""")
KNOWN_ENABLING = word_set("""
DIAGEXACT ENERGY FWDINV INVDISCRETE IPC OVERRIDE SLEEP SPECULATIVE
""")
KNOWN_FIELDS = frozenset()
KNOWN_FIELDS |= word_set("""
bvhadr bvhnum conaffinity contype dofadr dofnum geomadr geomnum gravcomp inertia invweight0 ipos iquat jntadr jntnum
margin mass mocapid parentid plugin pos quat rootid sameframe simple subtreemass treeid user weldid
""", "body_")  # fmt: skip
KNOWN_FIELDS |= word_set("""
M0 Madr armature bodyid damping dampingpoly frictionloss invweight0 jntid length parentid simplenum solimp solref treeid
""", "dof_")  # fmt: skip
KNOWN_FIELDS |= word_set("""
actfrclimited actfrcrange actgravcomp actuatorid axis bodyid dofadr group limited margin plasticadr pos qposadr range
solimp solref springyield stiffness stiffnesspoly type user
""", "jnt_")  # fmt: skip
KNOWN_FIELDS |= word_set("""
actfrclimited actfrcrange actuatorid adr armature damping dampingpoly frictionloss group invweight0 length0 lengthspring
limited margin matid num plasticadr range rgba solimp_fri solimp_lim solref_fri solref_lim springyield stiffness
stiffnesspoly treeid treenum type user width
""", "tendon_")  # fmt: skip
KNOWN_FIELDS |= word_set("""
active0 data obj1id obj2id objtype solimp solref type
""", "eq_")  # fmt: skip
KNOWN_FIELDS |= word_set("""
acc0 actadr actearly actlimited actnum actrange armature biasprm biastype cranklength ctrladr ctrllimited ctrlnum
ctrlrange ctrlspec damping dampingpoly delay dynprm dyntype forcelimited forcerange gainprm gaintype gear group history
historyadr length0 lengthrange outadr outnum plugin trnid trntype user
""", "actuator_")  # fmt: skip
