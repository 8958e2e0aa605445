"""Values of a compiled model that no robot has, refused by the name of what has them."""

import mujoco
import numpy as np

from .joints import joint_name, own_name

BODY_FIELDS = {
    "pos": "body_pos",
    "quat": "body_quat",
    "mass": "body_mass",
    "inertia": "body_inertia",
    "inertial pos": "body_ipos",
    "inertial quat": "body_iquat",
}
JOINT_FIELDS = {"pos": "jnt_pos", "axis": "jnt_axis", "stiffness": "jnt_stiffness"}
SPEED_FIELDS = {"armature": "dof_armature", "damping": "dof_damping"}
ACTUATOR_FIELDS = {"gain": "actuator_gainprm", "bias": "actuator_biasprm", "gear": "actuator_gear"}
TENDON_FIELDS = {"stiffness": "tendon_stiffness", "damping": "tendon_damping"}
NOT_BELOW_ZERO = ("stiffness", "armature", "damping")


def refuse_values(m: mujoco.MjModel) -> None:
    """ValueError, in one line, for a number that is not finite or has a sign that it cannot have."""
    bodies = [own_name(m.body(i).name, "body", i) for i in range(m.nbody)]
    joints = [joint_name(m, j) for j in range(m.njnt)]
    for what, names, fields in (
        ("body", bodies, BODY_FIELDS),
        ("joint", joints, JOINT_FIELDS),
        ("joint", [joints[j] for j in m.dof_jntid], SPEED_FIELDS),
    ):
        for word, field in fields.items():
            values = getattr(m, field).reshape(len(names), -1)
            wrong = ~np.isfinite(values) | ((values < 0.0) & (word in NOT_BELOW_ZERO))
            for i in np.flatnonzero(wrong.any(axis=1)):
                accepted = "a finite number of at least 0" if word in NOT_BELOW_ZERO else "finite numbers"
                found = " ".join(f"{value:g}" for value in values[i])
                verb = "is" if word in NOT_BELOW_ZERO else "are"
                raise ValueError(f"the {word} of {what} {names[i]!r} is {found}; {accepted} {verb} expected")
    for what, fields in (("actuator", ACTUATOR_FIELDS), ("tendon", TENDON_FIELDS)):
        for word, field in fields.items():
            for i in sorted({*np.argwhere(~np.isfinite(getattr(m, field)))[:, 0]}):
                name = own_name(getattr(m, what)(i).name, what, i)
                raise ValueError(f"the {word} of {what} {name!r} has a number that is not finite")
    for word, values in (
        ("gravity", m.opt.gravity),
        ("reference position", m.qpos0),
        ("rest position of its springs", m.qpos_spring),
        *((f"keyframe {own_name(m.key(k).name, 'key', k)!r}", m.key_qpos[k]) for k in range(m.nkey)),
        *((f"control of keyframe {own_name(m.key(k).name, 'key', k)!r}", m.key_ctrl[k]) for k in range(m.nkey)),
    ):
        if not np.isfinite(values).all():
            raise ValueError(f"its {word} has a number that is not finite")
