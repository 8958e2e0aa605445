"""A file's model without what it does not need: no textures and visual meshes, and where nothing can touch no geoms at all.

Textures and meshes are nearly all of a robot's memory (252 MB of one quadruped, 22 kB without), and every copy copies them.
"""

import mujoco
import numpy as np

from .joints import aligns
from .unknown import PREFIXES

FROM_GEOMS = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
WRAPPED = mujoco.mjtWrap.mjWRAP_SPHERE, mujoco.mjtWrap.mjWRAP_CYLINDER
INERTIAL = "mass", "inertia", "ipos", "iquat"
OF_GEOMS = "body_margin", "dof_length"  # fields that decide contacts and who falls asleep


def without_visuals(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """The spec, to be compiled with every body of the file and without what is only drawn.

    In a medium geoms that touch nothing are pushed too: they stay. Fusing bodies would only renumber them.
    """
    for body in spec.bodies[1:]:
        if mujoco.mjtInertiaFromGeom(body.compiler.inertiafromgeom) == FROM_GEOMS and body.geoms:
            body.explicitinertial, body.ipos, body.mass = False, np.full(3, np.nan), 0.0  # of geoms, whatever it states
    for compiler in (spec.compiler, *(body.compiler for body in spec.bodies)):
        if mujoco.mjtInertiaFromGeom(compiler.inertiafromgeom) == FROM_GEOMS:
            compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO  # which discardvisual demands
    spec.compiler.fusestatic = False
    spec.compiler.discardvisual = not (spec.option.density or spec.option.viscosity)
    return spec


def without_geoms(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """The spec without what only contacts, sensors and pictures need; the inertia of every body stays, to the last bit.

    Geoms stay that a tendon wraps around, and those of a free body whose frame the compiler turns into its inertial frame.
    """
    without_visuals(spec).compiler.discardvisual = True
    for element in (*spec.sensors, *spec.pairs, *spec.excludes, *spec.tuples, *spec.skins):
        spec.delete(element)
    wrapped = {wrap.target.name for tendon in spec.tendons for wrap in tendon.path if wrap.type in WRAPPED}
    bodies = [body for body in spec.bodies if not any(map(aligns, body.joints))]
    is_stated = spec.compiler.settotalmass <= 0.0
    take_geoms([body for body in bodies if is_stated and states_inertia(body)], wrapped, spec)
    if any(body.geoms for body in bodies[1:]) or not is_stated:
        whole = spec.compile()
        for body in bodies[1:]:
            body.explicitinertial, body.fullinertia = True, np.full(6, np.nan)
            body.ialt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
            for name in INERTIAL:
                setattr(body, name, getattr(whole, f"body_{name}")[body.id].copy())
        spec.compiler.settotalmass = -1.0
        take_geoms(bodies, wrapped, spec)
    used = {name for geom in spec.geoms for name in (geom.meshname, geom.hfieldname)}
    for asset in (*spec.meshes, *spec.hfields):
        if asset.name not in used:
            spec.delete(asset)
    return spec


def states_inertia(body: mujoco.MjsBody) -> bool:
    """Whether geoms have no part in the inertia of a body."""
    return bool(body.explicitinertial) or body.name == "world"


def take_geoms(bodies: list, wrapped: set[str], spec: mujoco.MjSpec) -> None:
    """Delete the geoms of these bodies that no tendon wraps around."""
    for geom in [geom for body in bodies for geom in body.geoms if not geom.name or geom.name not in wrapped]:
        spec.delete(geom)


def moves_the_same(one: mujoco.MjModel, other: mujoco.MjModel) -> bool:
    """Whether two models of a file have the same numbers, to the last bit, in all that decides a motion without contacts."""
    names = [name for name in dir(one) if name.startswith(PREFIXES) and name not in OF_GEOMS]
    pairs = [(np.asarray(getattr(one, name)), np.asarray(getattr(other, name))) for name in names]
    return all(np.array_equal(a, b) for a, b in pairs if a.dtype.kind == "f")
