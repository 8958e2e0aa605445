"""Runs of a plant by Drake's integrators."""

from typing import Any

import numpy as np

from .. import Array, Course
from ..outside.file import EngineError
from ..outside.order import Order

SCHEMES = {"RK2": (2, "runge_kutta2"), "RK3": (3, "runge_kutta3"), "RK5": (5, "runge_kutta5"),
           "implicit Euler": (1, "implicit_euler"), "Radau3": (3, "radau3")}  # fmt: skip
DISCRETE = "discrete"  # the plant's own step
ITERATES = "implicit Euler", "Radau3"
ITERATED = 1e-12  # relative accuracy of their iterations at fixed steps
LONGEST = 0.1  # s, of a step of a method that chooses its own: Drake's default


class Simulation:
    """A plant with the force and the integrator of a course."""

    def __init__(self, plant: Any, order: Order, course: Course):
        from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

        self.plant, self.order = plant, order
        is_of_ball = np.array(order.file.coordinates.kinds_of_speeds) == "ball"
        if course.tau[order.is_of_free() | is_of_ball].any():
            raise EngineError(
                "a constant torque on a ball or a free body would turn with it, as Drake's axes do not"
            )
        simulator = self.simulator = Simulator(plant)
        self.context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        fixed_force(plant, self.context).SetFromVector(course.tau[order.v])
        if course.method != DISCRETE:
            scheme = SCHEMES[course.method.removesuffix(" adaptive")][1]
            integrator = ResetIntegratorFromFlags(simulator, scheme, course.dt if course.steps else LONGEST)
            integrator.set_fixed_step_mode(course.tolerance is None)
            if course.tolerance or course.method in ITERATES:
                integrator.set_target_accuracy(course.tolerance or ITERATED)

    def run(self, course: Course) -> tuple[Array, int]:
        """See ReadModel.run."""
        plant, context, is_discrete = self.plant, self.context, course.method == DISCRETE
        start = self.order.state(course.q, course.v)
        self.simulator.get_mutable_context().SetTime(0.0)
        plant.SetPositionsAndVelocities(context, np.concatenate([start.x, start.u]))
        self.simulator.get_mutable_integrator().ResetStatistics()
        self.simulator.Initialize()
        states = [course.start]
        for t in course.times[1:]:
            try:  # the last of the discrete steps up to t begins at t - dt
                self.simulator.AdvanceTo(t - 0.5 * course.dt if is_discrete else t)
            except RuntimeError:  # it finds no step, or no solution of its equations
                break
            reached = self.order.tree_state(plant.GetPositions(context), plant.GetVelocities(context))
            states.append(np.concatenate(reached))
        evaluations = self.simulator.get_integrator().get_num_derivative_evaluations()
        return np.array(states), course.steps if is_discrete else evaluations


def fixed_force(plant: Any, context: Any) -> Any:
    """The vector of generalized forces in a context, in Drake's order and axes."""
    port = plant.get_applied_generalized_force_input_port()
    return port.FixValue(context, np.zeros(plant.num_velocities())).GetMutableData().get_mutable_value()
