"""Compiled models without locked joints, with bodies that are welded, or have no mass, as one; what specs lose."""

from collections.abc import Collection, Mapping

import mujoco
import numpy as np

from ...robots.coordinates import point_inertia
from .inventory import contact_pairs
from .names import (
    FROM_4,
    OF_A_JOINT,
    aligns,
    element_name,
    joint_name,
    joint_places,
    kind_of,
    parts_of,
    rotors,
    tensor,
)

FROM_GEOMS = int(mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE)
REFERRING = {  # the types of equalities, transmissions and objects of sensors that name an element
    "joint": (mujoco.mjtEq.mjEQ_JOINT, OF_A_JOINT, mujoco.mjtObj.mjOBJ_JOINT),
    "tendon": (mujoco.mjtEq.mjEQ_TENDON, (mujoco.mjtTrn.mjTRN_TENDON,), mujoco.mjtObj.mjOBJ_TENDON),
}
PARTS_OF_FREE = [mujoco.mjtJoint.mjJNT_SLIDE] * 3 + [mujoco.mjtJoint.mjJNT_BALL]
Positions = Mapping[str, float | tuple[float, ...]]  # of joints by name: rad, m or a quaternion
# kg and kg m2: more than the least mass that MuJoCo compiles, less than the rounding of any other
LEAST = 1e-14
LIGHT = 1e-6  # share of a mass, and of M at the position zero, that stands for none
NO_MASS = "mass and inertia of moving bodies"  # in MuJoCo's message


def compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The model of a spec, also where a link without mass carries others, which MuJoCo refuses."""
    try:
        return spec.compile()
    except ValueError as error:
        if NO_MASS not in str(error) or spec.compiler.settotalmass > 0.0:
            raise
    stated = spec.compiler.boundmass, spec.compiler.boundinertia
    spec.compiler.boundmass = spec.compiler.boundinertia = LEAST
    model = spec.compile()
    spec.compiler.boundmass, spec.compiler.boundinertia = stated
    model.body_mass[model.body_mass == LEAST] = 0.0
    model.body_inertia[model.body_inertia == LEAST] = 0.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    if empty := [int(body) for body in model.jnt_bodyid if not model.body_subtreemass[body]]:
        name = element_name(model, "body", empty[0])
        raise ValueError(f"{name} moves, and neither it nor what it carries has mass")
    return model


def welded_bodies(model: mujoco.MjModel) -> dict[int, int]:
    """The bodies with mass and without a joint, and the body to which each is fixed, 0: the world.

    Those of negligible mass are among them, fixed to the world.
    """
    massive = (model.body_mass > 0.0) | (model.body_inertia > 0.0).any(axis=1)
    bodies = np.flatnonzero(massive & (model.body_weldid != np.arange(model.nbody)))
    welded = {int(body): int(model.body_weldid[body]) for body in bodies}
    return welded | dict.fromkeys(negligible(model, np.flatnonzero(massive)), 0)


def negligible(model: mujoco.MjModel, bodies: np.ndarray) -> list[int]:
    """Those of some bodies that move with others, and whose mass and inertia stand for none."""
    most = LIGHT * model.body_subtreemass[model.body_weldid[bodies]]
    found = []
    for body in bodies[(model.body_mass[bodies] <= most) & (model.body_weldid[bodies] > 0)]:
        without = mujoco.MjModel.__copy__(model)
        without.body_mass[body] = without.body_inertia[body] = 0.0
        mujoco.mj_setConst(without, mujoco.MjData(without))
        if np.allclose(without.dof_M0, model.dof_M0, rtol=LIGHT, atol=0.0):
            found.append(int(body))
    return found


def join(model: mujoco.MjModel, welded: Mapping[int, int]) -> None:
    """Give each body the mass, centre of mass and inertia of those welded to it, which lose theirs."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    fixed = [body for body, base in welded.items() if not base]
    model.body_mass[fixed], model.body_inertia[fixed] = 0.0, 0.0
    for base in set(welded.values()) - {0}:
        group = [base, *(body for body, onto in welded.items() if onto == base)]
        masses, centres = model.body_mass[group], data.xipos[group]
        com, total = masses @ centres / masses.sum(), np.zeros((3, 3))
        for body, mass, centre in zip(group, masses, centres - com):
            total += tensor(data.ximat[body].reshape(3, 3), model.body_inertia[body])
            total += point_inertia(centre, mass)
        turn = data.xmat[base].reshape(3, 3)
        moments, axes = np.linalg.eigh(turn.T @ total @ turn)
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        model.body_mass[group], model.body_inertia[group] = 0.0, 0.0
        model.body_mass[base], model.body_inertia[base] = masses.sum(), moments
        model.body_ipos[base] = turn.T @ (com - data.xpos[base])
        mujoco.mju_mat2Quat(model.body_iquat[base], axes.ravel())
        model.body_sameframe[base] = model.body_simple[base] = 0
        model.dof_simplenum[:] = 0
    mujoco.mj_setConst(model, mujoco.MjData(model))


def compiled_without(spec: mujoco.MjSpec, positions: Positions, bare: bool) -> mujoco.MjModel:
    """The model whose bodies and other joints are where mj_kinematics has them with the joints locked."""
    model = compiled(spec)
    data, places = mujoco.MjData(model), joint_places(model)
    data.qpos[:] = model.qpos0
    for name, place in places.items():
        if name in positions or kind_of(model, place.joint) == "free":
            data.qpos[place.qpos] = positions.get(name, (1.0, 0.0, 0.0, 0.0) if place.kind == "ball" else 0.0)
    mujoco.mj_kinematics(model, data)
    for joint in spec.joints:
        joint.name = joint_name(model, joint.id)
    numbers = {joint.name: joint.id for joint in spec.joints}  # a change of the spec takes them away
    # a free joint goes as a whole, and the parts that stay are added
    removed = {joint_name(model, places[name].joint) for name in positions}
    moved = [body for body in spec.bodies if removed.intersection(joint.name for joint in body.joints)]
    for body, number in [(body, body.id) for body in moved]:
        axes = data.xmat[number].reshape(3, 3)
        parent, quat = model.body_parentid[number], np.zeros(4)
        mujoco.mju_mulQuat(quat, data.xquat[parent] * [1.0, -1.0, -1.0, -1.0], data.xquat[number])
        body.set_frame(body.parent.add_frame())
        body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
        body.pos = (data.xpos[number] - data.xpos[parent]) @ data.xmat[parent].reshape(3, 3)
        body.quat = quat
        for joint in list(body.joints):
            i = numbers[joint.name]
            if joint.name not in removed:
                joint.set_frame(body.add_frame())
                joint.pos, joint.axis = (data.xanchor[i] - data.xpos[number]) @ axes, data.xaxis[i] @ axes
            elif kind_of(model, i) == "free":
                armature = model.dof_armature + rotors(model)  # of actuators too, which are deleted
                add_parts(body, joint, float(armature[model.jnt_dofadr[i]]), positions, axes)
    clear(spec, removed, bare)
    smaller = compiled(spec)
    if not bare and (touching := pairs_of_bodies(smaller) - pairs_of_bodies(model)):
        for body in spec.bodies:
            body.name = element_name(smaller, "body", body.id)
        # they are neighbours, whose contacts MuJoCo leaves out unless one of them is fixed
        for pair in touching:
            one, other = (element_name(smaller, "body", number) for number in pair)
            spec.add_exclude(bodyname1=one, bodyname2=other)
        smaller = compiled(spec)
    # of springdamper the compiler chooses both by the inertia
    for name, place in joint_places(smaller).items():
        before = places[name]
        smaller.qpos_spring[place.qpos] = model.qpos_spring[before.qpos]
        smaller.dof_damping[place.dofs] = model.dof_damping[before.dofs]
        smaller.jnt_stiffness[place.joint] = model.jnt_stiffness[before.joint]
    return smaller


def pairs_of_bodies(model: mujoco.MjModel) -> set[tuple[int, int]]:
    """The bodies whose geoms may touch, by number, the smaller one first."""
    pairs = np.sort(model.geom_bodyid[contact_pairs(model)], axis=1)
    return set(map(tuple, pairs.tolist()))


def add_parts(
    body: mujoco.MjsBody, free: mujoco.MjsJoint, armature: float, locked: Positions, axes: np.ndarray
) -> None:
    """Add the parts of a free joint that are not locked. axes: of the body, as columns."""
    if aligns(free):
        why = "is aligned with the inertia of its body: none of its parts can be locked"
        raise ValueError(f"free joint {free.name!r} {why}")
    no_defaults = {"ref": 0.0, "springdamper": np.zeros(2), "limited": mujoco.mjtLimited.mjLIMITED_FALSE}
    for name, kind, axis in zip(parts_of(free.name), PARTS_OF_FREE, [*axes, axes[2]]):
        if name not in locked:
            body.add_joint(name=name, type=kind, axis=axis, pos=np.zeros(3), armature=armature, **no_defaults)


def clear(spec: mujoco.MjSpec, removed: set[str], bare: bool) -> None:
    """Delete joints of these names, and what refers to them."""
    needless = [*spec.keys, *spec.sensors]
    if bare:
        needless += [*spec.equalities, *(actuator for actuator in spec.actuators if not actuator.armature)]
    for element in needless:
        spec.delete(element)
    delete_named(spec, "tendon", spec.tendons if bare else ())
    delete_named(spec, "joint", [joint for joint in spec.joints if joint.name in removed])


def delete_named(
    spec: mujoco.MjSpec, kind: str, elements: Collection[mujoco.MjsJoint | mujoco.MjsTendon]
) -> None:
    """Delete joints or tendons after what refers to them: the other way round MuJoCo crashes."""
    names, (tie, target, thing) = {element.name for element in elements} - {""}, REFERRING[kind]
    referring = [element for element in spec.equalities if element.type == tie]
    referring += [element for element in spec.actuators if element.trntype in target]
    referring += [element for element in spec.sensors if element.objtype == thing]
    for element in referring:
        fields = ("name1", "name2", "target", "objname")
        if names.intersection(getattr(element, field, "") for field in fields):
            spec.delete(element)
    for element in elements:
        spec.delete(element)


def delete_geoms(spec: mujoco.MjSpec, geoms: Collection[mujoco.MjsGeom]) -> None:
    """Delete geoms, pairs of them, and meshes and height fields that no geom has then."""
    names = {geom.name for geom in geoms} - {""}
    pairs = [pair for pair in spec.pairs if {pair.geomname1, pair.geomname2} & names]
    for element in (*pairs, *geoms):
        spec.delete(element)
    used = {name for geom in spec.geoms for name in (geom.meshname, geom.hfieldname)}
    for asset in [asset for asset in (*spec.meshes, *spec.hfields) if asset.name not in used]:
        spec.delete(asset)


def delete_meshes(spec: mujoco.MjSpec) -> None:
    """Delete meshes and height fields that give no inertia, their geoms, and what may refer to these."""
    for element in (*spec.sensors, *spec.tuples, *spec.pairs):
        spec.delete(element)
    meshes = [geom for geom in spec.geoms if geom.meshname or geom.hfieldname]
    delete_geoms(spec, [geom for geom in meshes if not gives_inertia(geom)])


def gives_inertia(geom: mujoco.MjsGeom) -> bool:
    """Whether the compiler takes mass of a body that moves from this geom."""
    body = geom.parent
    is_stated = body.explicitinertial and body.compiler.inertiafromgeom != FROM_GEOMS
    low, high = body.compiler.inertiagrouprange
    has_mass = geom.mass != 0.0 and geom.density != 0.0 and low <= geom.group <= high
    return has_mass and not is_stated and moves(body)


def moves(body: mujoco.MjsBody) -> bool:
    while body.name != "world":  # whose parent is no body, and in MuJoCo 3.10 not even none
        if body.joints:
            return True
        body = body.parent
    return False


def without_visuals(stated: mujoco.MjSpec) -> mujoco.MjSpec:
    """A copy of a spec without what is only drawn; when compiled it has every body of the file.

    A medium pushes geoms that touch nothing, and they may have the mass: there they stay.
    """
    spec = stated.copy()
    spec.compiler.fusestatic = False  # fused bodies would only be renumbered
    spec.compiler.discardvisual = not (spec.option.density or spec.option.viscosity or is_from_geoms(spec))
    delete_textures(spec)
    return spec


def delete_textures(spec: mujoco.MjSpec) -> int:
    """Delete all textures, which are large in each copy of a model; how many there were.

    Before MuJoCo 4 a material asks for the texture that it had: they stay.
    """
    if not FROM_4:
        return 0
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
    textures = list(spec.textures)
    for texture in textures:
        spec.delete(texture)
    return len(textures)


def is_from_geoms(spec: mujoco.MjSpec) -> bool:
    """Whether geoms have the mass of some body, whatever its inertial says."""
    return any(body.compiler.inertiafromgeom == FROM_GEOMS for body in spec.bodies)
