"""Integration methods as data, each with one step written over any scalar.

A step takes the state (q, qd), each a list of n scalars, and `acceleration(q, qd) -> qdd`, and returns
the state one dt later. The same lines integrate floats, complex numbers (their exact Jacobian), mpmath
numbers and traced expressions (the compiled loop of kernels.py).
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class RungeKutta:
    """An explicit Runge-Kutta method, given by its Butcher tableau.

    Applied to (q, qd) as one first-order system, like MuJoCo's RK4. Raises ValueError if the tableau
    is not explicit, a row of A does not sum to c, or b does not sum to 1.
    """

    order: int
    A: tuple  # row i: the weights of stages 0 .. i-1 in stage i
    b: tuple  # the weights of the stages in the step
    c: tuple  # the time of each stage in units of dt

    def __post_init__(self):
        if not len(self.A) == len(self.b) == len(self.c):
            raise ValueError("A, b and c must have one entry for each stage")
        for i, (row, c) in enumerate(zip(self.A, self.c)):
            if len(row) != i:
                raise ValueError(f"row {i} of A has {len(row)} entries; an explicit method has {i}")
            if abs(sum(row) - c) > 1e-14:
                raise ValueError(f"row {i} of A sums to {sum(row)}, not to c = {c}")
        if abs(sum(self.b) - 1.0) > 1e-14:
            raise ValueError(f"b sums to {sum(self.b)}, not to 1")

    def step(self, acceleration, q, qd, dt):
        stages = []
        for row in self.A:
            q_i = advance(q, dt, row, [rate for rate, _ in stages])
            qd_i = advance(qd, dt, row, [change for _, change in stages])
            stages.append((qd_i, acceleration(q_i, qd_i)))
        rates, changes = zip(*stages)
        return advance(q, dt, self.b, rates), advance(qd, dt, self.b, changes)


def advance(start, dt, weights, slopes):
    """start + dt * sum of weights * slopes, component by component."""
    result = []
    for k, value in enumerate(start):
        terms = [slope[k] if w == 1.0 else w * slope[k] for w, slope in zip(weights, slopes) if w != 0.0]
        result.append(value + dt * sum(terms[1:], terms[0]) if terms else value)
    return result


METHODS = {
    "rk4": RungeKutta(  # the classical method of Kutta (1901), the assignment's part i
        order=4,
        A=((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)),
        b=(1 / 6, 1 / 3, 1 / 3, 1 / 6),
        c=(0.0, 0.5, 0.5, 1.0),
    ),
}
