"""Edits of the comparison state by state: the model read back, printed numbers, Mbar, bias, accelerations."""

from ..edit import Edit

READ = (
    "flag gravity", "flag damper", "flag eulerdamp", "order", "ref", "axis", "anchor", "damping", "armature", "frictionloss",
    "stiffness", "limited", "mass", "com", "inertia", "gravcomp", "gravity", "density", "viscosity", "other mass",
    "tendon armature",
)  # fmt: skip
FOUND = "np.asarray(compiled[quantity], dtype=float)"
EDITS = (
    Edit("mujoco.parameters", "lengths", "before + of_bodies", "10 * (before + of_bodies)",
         "a centre of mass may be off by ten times as much"),
    *(
        Edit("parameters", "beside_stated", FOUND, f"{FOUND} * 0 + stated.get(quantity, 0) if quantity == {name!r} else {FOUND}",
             f"{name} is read as stated")
        for name in READ
    ),
    Edit("parameters", "beside_stated", "FACTOR * EPS * _1", "1e-3 * _1", "a number may be off by a thousandth"),
    Edit("parameters", "rows", "sorted(result.causes, key=_1)", "result.causes", "causes in the order in which they are found"),
    Edit("parameters.numbers", "compare_number", "quantity in OPTIONS", "False", "an option is no cause of rank 1"),
    Edit("parameters.numbers", "compare_number", "[words.get(value, _1) for value in (a, b)]",
         "[words.get(value, _1) for value in (b, a)]", "stated and compiled are exchanged"),
    Edit("mujoco.reading", "read", "(model.body_mass > 0.0) | _1", "(model.body_mass > 0.0) & _1", "a point mass is no body"),
    Edit("mujoco.reading", "bodies_as_in", "stated if _1 else bodies", "bodies",
         "bodies of a solution are matched by their order"),
    Edit("mujoco.parameters", "row_of", "max(FACTOR * EPS, precision)", "1e-3",
         "a number of a file may be off by a thousandth"),
    Edit("parameters", "rows", "number.why if is_of_file else None", "''", "nothing asks for a change"),
    Edit("mujoco.parameters", "of_body", "np.trace(stated_inertia)", "100 * np.trace(stated_inertia)",
         "a tensor by more"),
    Edit("parameters", "beside_stated", "added.get(quantity, _1)", "_1", "a place that is stated as 0 is exactly 0"),
    Edit("parameters", "rows", "number.stated is not None and not number.why", "number.stated is not None and number.why",
         "what an option asks for is compared, and nothing else"),
    Edit("parameters.numbers", "compare_number", "not difference[k] <= tolerance", "difference[k] > tolerance",
         "NaN is no cause"),
    Edit("parameters.numbers", "check_forces", "source == 'fluid and tendons'", "True",
         "every force gets the tolerance of rounding"),
    Edit("parameters.numbers", "check_forces", "np.abs(sample.qd * tree.damping).max()",
         "1e6 * np.abs(sample.qd * tree.damping).max()", "the tolerance of forces x 1e6"),
    Edit("parameters.numbers", "check_forces", "np.abs(force).max()", "0.0 * np.abs(force).max()", "no force is seen"),
    Edit("reference", "compared_with", "path is None or has_hinges(source, ARM.joints)", "True",
         "any file is that of the arm"),
    Edit("mujoco.parameters", "remarks", "feature.treatment in (OFF, OPEN, LEFT_OUT)", "feature.treatment == OFF",
         "an open tree is not said"),
    Edit("mujoco.parameters", "row_of", "is_on and not is_same", "is_on", "an option without effect is said to change numbers"),
    Edit("engines.mujoco.dynamics", "MujocoDynamics.other_forces", "d.qfrc_actuator[_1]", "0 * d.qfrc_actuator[_1]",
         "actuators exert no force"),
    Edit("engines.mujoco.dynamics", "MujocoDynamics.other_forces", "d.qfrc_constraint[_1]", "0 * d.qfrc_constraint[_1]",
         "contacts exert no force"),
)  # fmt: skip
