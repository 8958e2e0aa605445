"""Edits of what tmt refuses and of what its compiled code reports."""

from ..edit import Edit

EDITS = (
    Edit("tree", "_check_inertia", "np.abs(inertia - inertia.T).max() > _1", "False", "an inertia need not be symmetric"),
    Edit("tree", "_check_inertia", "a + b < _1", "False", "one principal inertia may be larger than the other two"),
    Edit("values", "numbers_of", "not np.isfinite(array).all()", "False", "a number of a Tree may be infinite"),
    Edit("given", "states", "not np.isfinite(array).all()", "False", "a state may be infinite"),
    Edit("sine", "LIMIT", "2.0**49", "2.0**60", "hinges may turn beyond 2^49 rad"),
    Edit("singular", "check_tree", "turning.any(axis=-1).all()", "False", "a Tree may be singular at every q"),
    Edit("implicit", "CLOSE", "1e-10", "1e-2", "Newton's method stops at two digits"),
    Edit("implicit", "ImplicitRungeKutta.step", "raise _1", "return self.finish(q, qd, dt, a)", "Newton's failure is not seen"),
    Edit("reference", "distance", "np.abs(_1)", "0.5 * np.abs(_1)", "the distance from 50 digits is halved"),
    Edit("tree", "_direction", "_1 == 0.0", "False", "an axis may be zero"),
    Edit("simulation", "by_series", "tolerance=tolerance", "tolerance=1e-33", "the tolerance of series is ignored"),
    Edit("simulation", "singular_in", "alive - 1", "0", "the last state is not looked at", nth=1),
    Edit("articulated", "outward", "2.0 * qd[by.start]", "qd[by.start]", "half of Coriolis' acceleration of a slide"),
    Edit("articulated", "about_point", "J.times(omegad) + _1", "_1", "no angular acceleration in Euler's equation"),
    Edit("articulated", "mass_matrix_and_bias", "M[k][k] + tree.armature[k]", "M[k][k]", "large trees have no armature"),
    Edit("entries", "Entries.wrong", "float('inf')", "2.0 * float('nan')", "compiled code finds every state wrong"),
    Edit("entries", "Entries.wrong", "size.get().compare('lt', float('inf'))", "size.get().compare('ge', 0.0)",
         "compiled code answers what is infinite"),
    Edit("entries", "Entries.wrong", "square.compare('ge', SHORTEST)", "square.compare('ge', 0.0)",
         "a quaternion may be shorter than 1"),
    Edit("forms", "directional", "[*(_1), *(slope for _, slope in parts)]", "[*(_1), *(2 * slope for _, slope in parts)]",
         "Newton's method has twice the Jacobian"),
    Edit("runs", "unsound", "angles.compare('lt', LIMIT)", "angles.compare('lt', float('inf'))", "turns have no limit"),
    Edit("semi_implicit", "SemiImplicitEuler.gains_held", "(tree.position_gain, tree.speed_gain)",
         "(tree.speed_gain, tree.position_gain)", "gains of positions act on speeds"),
    Edit("answers", "Answers.of_one", "self.may_be_singular", "False", "compiled code answers where Mbar is singular"),
    Edit("answers", "Answers.of_any", "self.asked[quantity] <= SMALL", "True", "machine code never answers unasked"),
)  # fmt: skip
