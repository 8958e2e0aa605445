"""Edits of what tmt refuses and of what its loops report."""

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
    Edit("simulation", "singular_in", "alive - 1", "0", "the last state is not looked at", nth=1),
    Edit("loop_bodies", "slid_along", "2.0 * speed", "speed", "half of Coriolis' acceleration of a slide"),
    Edit("loop_bodies", "point", "omegad.cross(arm) + _1", "_1", "no angular acceleration in the convective terms of a point"),
    Edit("loop_bodies", "put_energy", "0.5 * joint.armature[k]", "joint.armature[k]", "rotors have twice their energy"),
    Edit("loop_bodies", "of_bodies", "3 * len(bodies) * n + at", "at", "B_b is written over T_b"),
    Edit("loop_answers", "finite", "others == 0", "True", "compiled code answers what is not finite"),
    Edit("loop_answers", "of_length_1", "not SHORTEST <= _1 <= LONGEST", "False", "a quaternion may have any length"),
    Edit("loop_answers", "to_rows", "out[first + l, j * n + i]", "out[first + l, i * n + j]", "Mbar of many is a triangle"),
    Edit("answers", "Known.of_one", "self.may_be_singular", "False", "compiled code answers where Mbar is singular"),
    Edit("answers", "Known.has_loops", "CALL + count", "count", "a call of the literal form costs nothing", nth=0),
    Edit("choice", "chosen", "wanted + before", "wanted", "what was asked before does not count"),
    Edit("loop_trees", "in_parts", "(inner.position_gain, inner.speed_gain)", "(inner.speed_gain, inner.position_gain)",
         "gains of positions act on speeds"),
)  # fmt: skip
