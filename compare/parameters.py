"""The compiled model read back beside the stated numbers."""

import numpy as np

import tmt

from .agreement import EPS, FACTOR, Result
from .engine_parameters import options, parameters

TITLE = "Parameters: is MuJoCo's compiled arm the stated arm?"
CLAIM = (
    "The MJCF file, as MuJoCo compiled it, has the stated masses, centres of mass, inertia tensors (turned back into body "
    "axes, R diag R'), hinge axes, anchors, order and gravity, and nothing that the method does not have: no "
    "armature, friction, springs, limits or further masses, and at random states no force of springs, fluid, tendons, "
    "actuators, constraints or contacts."
)
BAR = (
    "64 eps x the largest entry of the quantity (the compiler stores each number once; turning the inertia to its "
    "principal axes and back costs a few roundings; MuJoCo 3.10 turns a fullinertia only to about 1e-8). What must be "
    "absent must be exactly 0."
)
UNITS = {
    "axis": "", "anchor": "m", "damping": "N m s/rad", "armature": "kg m2", "frictionloss": "N m",
    "stiffness": "N m/rad", "limited": "", "order": "", "mass": "kg", "com": "m", "inertia": "kg m2",
    "gravcomp": "", "gravity": "m/s2", "other mass": "kg", "tendon armature": "kg m2",
}  # fmt: skip


def stated(model=tmt.ARM) -> dict:
    """The same quantities from the stated numbers: arrays per hinge, per body, or one."""
    n, m = len(model.hinge_names), len(model.body_names)
    anchors = []
    for parent, offset in zip(model.parent, model.offset):
        anchors.append(np.array(offset) + (anchors[parent] if parent >= 0 else 0.0))
    absent = {"armature": n, "frictionloss": n, "stiffness": n, "limited": n, "gravcomp": m}
    return {name: np.zeros(count) for name, count in absent.items()} | {
        "axis": model.axis,
        "anchor": anchors,
        "damping": model.damping,
        "order": range(n),
        "mass": model.mass,
        "com": model.com,
        "inertia": model.inertia,
        "gravity": model.gravity,
        "other mass": 0.0,
        "tendon armature": 0.0,
    }


def rows(setup) -> Result:
    """One row for each number; one check for each quantity of each hinge or body."""
    result = Result("parameters", shown=["of", "quantity", "component", "stated", "compiled", "unit"])
    compiled = parameters(setup.engine)
    owners = {len(tmt.ARM.hinge_names): tmt.ARM.hinge_names, len(tmt.ARM.body_names): tmt.ARM.body_names}
    for quantity, expected in stated().items():
        expected, found = np.asarray(expected, dtype=float), np.asarray(compiled[quantity], dtype=float)
        names = ("world",) if quantity in ("gravity", "other mass", "tendon armature") else owners[len(expected)]
        for owner, e, f in zip(names, expected.reshape(len(names), -1), found.reshape(len(names), -1)):
            result.check(
                owner, quantity, np.abs(e - f).max(), FACTOR * EPS * np.abs(e).max(), UNITS[quantity], rounding=True
            )
            for k, (a, b) in enumerate(zip(e, f)):
                result.rows.append(
                    {
                        "of": owner,
                        "quantity": quantity,
                        "component": component(k, len(e)),
                        "stated": a,
                        "compiled": b,
                        "difference": b - a,
                        "unit": UNITS[quantity],
                    }
                )
    sample = setup.random
    for source, force in setup.engine.other_forces(sample.q, sample.qd).items():
        result.check(sample.name, f"forces of {source}", np.abs(force).max(), 0.0, "N m")
    for option, value in options(setup.engine).items():
        result.rows.append({"of": "file", "quantity": option, "component": "", "compiled": value, "unit": ""})
    result.curves["com"] = compiled["com"]
    return result


def component(k, count) -> str:
    """The k-th of 1, 3 or 9 components by name."""
    if count == 1:
        return ""
    return "xyz"[k] if count == 3 else "xyz"[k // 3] + "xyz"[k % 3]


def figures(result):
    from . import draw  # matplotlib is for the process that draws

    yield draw.sketch()
