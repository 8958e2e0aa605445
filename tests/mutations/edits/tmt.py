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
)  # fmt: skip
