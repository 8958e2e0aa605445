"""Edits of the comparison state by state: the model read back, printed numbers, Mbar, bias, accelerations."""

READ = (
    "flag gravity", "flag damper", "flag eulerdamp", "order", "ref", "axis", "anchor", "damping", "armature", "frictionloss",
    "stiffness", "limited", "mass", "com", "inertia", "gravcomp", "gravity", "density", "viscosity", "other mass",
    "tendon armature",
)  # fmt: skip
FOUND = "np.asarray(compiled[quantity], dtype=float)"
EDITS = (
    ("mujoco.parameters", "lengths", "before + of_bodies", "10 * _0", "a centre of mass may be off by tenfold"),
    *(
        ("parameters", "beside_stated", FOUND, f"_0 * 0 + stated.get(quantity, 0) if quantity == {name!r} else _0",
         f"{name} is read as stated")
        for name in READ
    ),
    ("robots.placement", "turned", "same.sum() > best", "same.sum() >= best", "a robot is turned though no more is the same"),
    ("robots.placement", "placed", "is_on_axis and _1", "_1", "an anchor may be anywhere"),
    ("robots.placement", "placed", "count > most", "True", "a robot is always drawn at its `ref`"),
    ("robots.placement", "directions", "np.zeros((3, 3))", "np.eye(3)", "the anchor of a ball may be anywhere"),
    ("mujoco.locked", "join", "masses.sum()", "masses.max()", "the mass of one body is that of several", 1),
    ("mujoco.locked", "compiled", "not model.body_subtreemass[body]", "False", "a link may move without mass"),
    ("mujoco.locked", "compiled_without", "not bare and _1", "False", "neighbours touch where joints are locked"),
    ("parameters.contacts", "touches", "not dynamics.may_touch", "True", "nothing touches"),
    ("parameters.common", "common_factor", "is_common and _1", "_1", "any factor is a common one"),
    ("parameters.common", "of_first", "(each for each in alike if is_near(*_1))", "same",
     "all wrong numbers are one cause"),
    ("parameters", "beside_stated", "FACTOR * EPS * _1", "1e-3 * _1", "a number may be off by a thousandth"),
    ("parameters", "rows", "sorted(result.causes, key=_1)", "result.causes", "causes in the order of finding"),
    ("parameters.numbers", "compare_number", "quantity in OPTIONS", "False", "an option is no cause of rank 1"),
    ("parameters.numbers", "compare_number", "(a, b)", "(b, a)", "stated and compiled are exchanged", 1),
    ("mujoco.reading", "read", "(_1 > 0.0) | _2", "(_1 > 0.0) & _2", "a point mass is no body"),
    ("mujoco.parameters", "stated_numbers", "stated[key] -= trace * np.eye(3)", "pass", "tensors have their trace more"),
    ("mujoco.parameters", "left_to_compiler", "not body.explicitinertial", "False", "what geoms give is stated"),
    ("mujoco.reading", "bodies_as_in", "len(bodies) != len(stated)", "False", "a body more is no difference"),
    ("mujoco.reading", "tree_of", "model.qpos0[_1] if has_reference else 0.0", "0.0", "a joint's ref is zero"),
    ("mujoco.source", "leave_out", "filter(gives_inertia, geoms)", "()", "a missing mesh has no mass"),
    ("mujoco.reading", "bodies_as_in", "stated if _1 else bodies", "bodies", "bodies are matched by their order"),
    ("mujoco.parameters", "stated_numbers", "FACTOR * EPS * size", "1e-3 * size", "a file may be off by a thousandth"),
    ("parameters", "rows", "number.why if is_of_file else None", "''", "nothing asks for a change"),
    ("parameters", "beside_stated", "added.get(quantity, _1)", "_1", "a place that is stated as 0 is exactly 0"),
    ("parameters", "rows", "not number.why", "number.why", "only what options ask for is compared"),
    ("parameters.numbers", "compare_number", "not _1 <= tolerance", "_1 > tolerance", "NaN is no cause"),
    ("parameters.numbers", "check_forces", "source == 'fluid and tendons'", "True", "every force may be rounding"),
    ("parameters.numbers", "check_forces", "np.abs(sample.qd * _1).max()", "1e6 * _0", "the tolerance of forces x 1e6"),
    ("parameters.numbers", "check_forces", "np.abs(force).max()", "0.0 * np.abs(force).max()", "no force is seen"),
    ("reference", "compared_with", "path is None or has_hinges(*_1)", "True", "any file is that of the arm"),
    ("mujoco.parameters", "remarks", "feature.treatment in _1", "feature.treatment == OFF", "an open tree is not said"),
    ("mujoco.parameters", "stated_numbers", "[name] * bool(change > tolerance)", "[name]", "every option changes a number"),
    ("mujoco.dynamics", "MujocoDynamics.other_forces", "d.qfrc_actuator[_1]", "0 * _0", "actuators exert no force"),
    ("mujoco.dynamics", "MujocoDynamics.other_forces", "d.qfrc_constraint[_1]", "0 * _0", "contacts exert no force"),
)  # fmt: skip
