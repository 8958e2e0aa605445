"""The methods of integration, each a `Method` (stepping.py) with one step, written over any scalar.

The same lines integrate floats, dual numbers (their exact Jacobian), mpmath numbers and traced expressions
(machine code, see tmt.compiled). METHODS may be given further ones.
"""

from dataclasses import dataclass

from tmt.derivation.coordinates import Coordinates
from tmt.derivation.vectors import Rows, Scalar, Values
from tmt.methods import dop853
from tmt.methods.derivatives import Linearized as Linearized
from tmt.methods.derivatives import amplification as amplification
from tmt.methods.derivatives import one_step as one_step
from tmt.methods.derivatives import transition as transition
from tmt.methods.implicit import ImplicitRungeKutta
from tmt.methods.semi_implicit import SemiImplicitEuler as SemiImplicitEuler
from tmt.methods.semi_implicit import by_speed as by_speed
from tmt.methods.semi_implicit import isolated_speeds as isolated_speeds
from tmt.methods.stepping import Method, Numbers, Slope, State, Tableau, advance, increments
from tmt.model.values import require, shown

Slopes = tuple[list[Values], list[Values]]  # of all stages: rates of the tangent, and accelerations


@dataclass(frozen=True)
class RungeKutta(Tableau):
    """An explicit Runge-Kutta method, by its Butcher tableau; ValueError if that is none, or not explicit.

    Applied to (q, qd) as one first-order system, like MuJoCo's RK4; to balls as Munthe-Kaas does, who keeps
    the order: what is integrated is the tangent from the start of the step.
    """

    # balls turn by the weighted mean of their speeds, as MuJoCo's RK4 up to 3.17: then of order 2
    mean_speed: bool = False

    def check_row(self, i: int, row: Numbers) -> None:
        if len(row) != i:
            raise ValueError(f"row {i} of A has {len(row)} entries; an explicit method has {i}")

    def step(self, slope: Slope, q: Values, qd: Values, dt: Scalar, joints: Coordinates) -> State:
        return self.combined(self.stage_slopes(slope, q, qd, dt, joints), q, qd, dt, joints)

    def stage_slopes(self, slope: Slope, q: Values, qd: Values, dt: Scalar, joints: Coordinates) -> Slopes:
        """The rates (of the tangent from q, see coordinates.py) and the accelerations of all stages."""
        rates: list[Values] = []
        changes: list[Values] = []
        for row in self.A:
            u, qd_i = increments(dt, row, rates, len(qd)), advance(qd, dt, row, changes)
            rates.append(qd_i if self.mean_speed else joints.rates(u, qd_i))
            changes.append(slope(joints.move(q, u), qd_i))
        return rates, changes

    def combined(self, slopes: Slopes, q: Values, qd: Values, dt: Scalar, joints: Coordinates) -> State:
        rates, changes = slopes
        return joints.move(q, increments(dt, self.b, rates, len(qd))), advance(qd, dt, self.b, changes)


@dataclass(frozen=True)
class AdaptiveRungeKutta(RungeKutta):
    """A Runge-Kutta method that chooses its own steps, by two embedded estimates of the error of each.

    Between two recorded states it takes steps for which the error, in units of tolerance * (1 + |value|),
    stays below 1; the estimates e5 and e3 combine to e5^2 / sqrt(e5^2 + 0.01 e3^2) (Hairer, Norsett, Wanner,
    section II.10).
    """

    # weights of the stages in the two estimates, of the tangent and of the speeds
    errors: tuple[Numbers, ...] = ()

    adaptive = True

    def __post_init__(self) -> None:
        super().__post_init__()
        self.set_rows("errors")
        if len(self.errors) != 2 or any(len(row) != len(self.b) for row in self.errors):
            raise ValueError("errors must be two rows of one weight for each stage")

    def attempt(self, slope: Slope, q: Values, qd: Values, dt: Scalar, joints: Coordinates) -> Rows:
        """A step, and the two estimates of its error, each for the tangent and qd."""
        slopes = self.stage_slopes(slope, q, qd, dt, joints)
        estimates = [increments(dt, weights, part, len(qd)) for weights in self.errors for part in slopes]
        return [*self.combined(slopes, q, qd, dt, joints), *estimates]


CLASSICAL = (  # Kutta (1901): A, b, c
    ((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)),
    (1 / 6, 1 / 3, 1 / 3, 1 / 6),
    (0.0, 0.5, 0.5, 1.0),
)
ROOT = 3**0.5 / 6
METHODS: dict[str, Method] = {
    "rk4": RungeKutta(4, *CLASSICAL),  # the assignment's part i
    "rk4_mean_speed": RungeKutta(2, *CLASSICAL, mean_speed=True),  # of order 2 where a ball tumbles
    "dopri8": RungeKutta(order=8, A=dop853.A, b=dop853.B, c=dop853.C),  # Dormand and Prince, fixed step
    "dopri8_adaptive": AdaptiveRungeKutta(8, dop853.A, dop853.B, dop853.C, errors=dop853.ERRORS),
    "explicit_euler": RungeKutta(order=1, A=((),), b=(1.0,), c=(0.0,)),
    "semi_implicit_euler": SemiImplicitEuler(implicit_bias=False),
    "implicit": SemiImplicitEuler(implicit_bias=True, implicit_gains=True),
    "implicitfast": SemiImplicitEuler(implicit_bias=False, isolated_bodies=True, implicit_gains=True),
    "discrete": SemiImplicitEuler(False, isolated_bodies=True, implicit_springs=True, implicit_gains=True),
    "implicit_midpoint": ImplicitRungeKutta(order=2, A=((0.5,),), b=(1.0,), c=(0.5,)),
    "gauss_legendre_4": ImplicitRungeKutta(  # Hairer, Norsett, Wanner, Solving ODEs I, II.7
        order=4,
        A=((1 / 4, 1 / 4 - ROOT), (1 / 4 + ROOT, 1 / 4)),
        b=(1 / 2, 1 / 2),
        c=(1 / 2 - ROOT, 1 / 2 + ROOT),
    ),
}


def method_named(name: str) -> Method:
    """The method of that name in METHODS, as it is there now; ValueError if there is none."""
    if not isinstance(name, str) or name not in METHODS:
        names = ", ".join(METHODS)
        raise ValueError(f"unknown method {shown(name)}; known are {names}, and for simulate taylor")
    stepping = METHODS[name]
    require(isinstance(stepping, Method), f"METHODS[{name!r}]", stepping, "a tmt.methods.Method is")
    return stepping
