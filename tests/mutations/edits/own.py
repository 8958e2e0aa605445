"""Edits of how equations of one's own are asked, mapped to the joints of a model, and compared with MuJoCo in Python."""

from ..edit import Edit

EDITS = (
    # how they are asked
    Edit("own.equations", "OwnEquations.first", "same(_1, _2)", "True", "a batch that gives something else is taken"),
    Edit("own.equations", "OwnEquations.called", "[np.array(part) for part in given]", "given", "no copies are handed over"),
    Edit("own.equations", "OwnEquations.values_of", "np.isfinite(computed)", "(computed == computed)",
         "infinite values are accepted"),
    Edit("own.functions", "SAME", "1e-12", "1e-6", "a batch may differ by a millionth"),
    Edit("own.equations", "SKEW", "1e-9", "1e-8", "M may be ten times less symmetric"),
    Edit("own.equations", "OwnEquations.note", "_1 <= DIVERGED", "_1 <= np.inf", "a run that has diverged is a problem"),
    Edit("own.equations", "OwnEquations.each", "np.arange(len(raised)) == i", "np.arange(len(raised)) >= 0",
         "one state that raises counts as all"),
    Edit("own.equations", "OwnEquations.acceleration", "tau - _1 - self.passive(q, v)", "tau - _1",
         "damping and springs are left out"),
    Edit("own.returned", "converted", "array.dtype.kind == 'c'", "False", "complex values are said to be no numbers"),
    Edit("own.returned", "converted", "len(array.shape) != len(expected)", "False", "a batch of one is a state"),
    Edit("engines.own", "OwnDynamics.acceleration", "case.added_damping * v", "0.0 * v", "damping of a scene is left out"),
    Edit("engines.own", "OwnDynamics.bias", "h - self.equations.gravity_balance(q)", "h", "gravity stays on in h"),
    # joints
    Edit("joint_map", "JointMap.own_positions", "_1 * self.sign + self.zero", "_1 * self.sign - self.zero",
         "a zero is taken the other way"),
    Edit("joint_map", "JointMap.own_forces", "_1 * self.sense", "_1", "a force keeps its sense"),
    Edit("joint_map", "JointMap.own_speeds", "_1 * self.of_v", "_1", "speeds stay in rad/s"),
    Edit("joint_map", "put", "np.argsort(at)", "at", "an order is taken the other way"),
    Edit("joint_map", "JointMap.after", "stated.sign * inner.zero", "inner.zero", "of two maps the first zero keeps its sense"),
    Edit("joint_map", "within_a_turn", "zero if slides else _1", "_1", "the zero of a slide is turned back"),
    Edit("joint_map", "same_names", "small.count(name) == right.count(name) == 1", "small.count(name) >= 1",
         "either of two names in other capitals is taken"),
    Edit("joint_map", "costs_of", "np.abs(along)", "along", "joints of opposite axes are never matched"),
    Edit("joint_map", "costs_of", "OF_PLACE * apart", "0.0 * apart", "joints are matched wherever they are"),
    Edit("joint_map", "costs_of", "OF_DEPTH * _1", "0.0 * _1", "joints are matched whatever carries them"),
    # the comparison
    Edit("agreement.given", "Compared.ratio", "np.where(np.isfinite(off), off, np.inf)", "np.where(np.isfinite(off), off, 0.0)",
         "NaN agrees"),
    Edit("agreement.given", "Given.__init__", "FACTOR * EPS + float(rtol)", "FACTOR * EPS", "rtol is not added"),
    Edit("agreement.given", "Given.__init__", "FACTOR * EPS + float(rtol)", "max(FACTOR, 96) * EPS + float(rtol)",
         "64 eps become 96"),
    Edit("agreement.given", "Given.fails", "comparison.ratio > 1.0", "comparison.ratio > 2.0", "twice the tolerance agrees"),
    Edit("agreement.given", "Given.table", "self.joints.mass_matrix(values)", "values", "a table of M keeps its own joints"),
    Edit("agreement.given", "Given.take_states", "self.joints.speeds(own['qd'])", "own['qd']", "speeds keep their own joints"),
    Edit("agreement", "assert_agrees", "given.fails or given.problems", "given.fails", "a changed argument agrees"),
    Edit("agreement", "rows", "-row.ratio", "row.ratio", "the smallest ratio first"),
    Edit("agreement.why", "some_states", "np.flatnonzero(np.isfinite(worst))", "np.arange(len(worst))",
         "a cause is sought where there are no values"),
)  # fmt: skip
