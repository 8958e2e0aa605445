"""Where a model rests: what falls, is left, is told; and what limits its step there."""

import numpy as np
import pytest
from small import BOX, CASTER, INERTIA, KINDS, LEG, STANDING, hinge, limit_of, place_of, rest_of

from compare.engines.mujoco.forces import rows_at
from compare.engines.mujoco.names import INTEGRATORS
from compare.engines.mujoco.reading import read
from compare.engines.mujoco.step import Step
from compare.stability.answer import Asked, limit_row, limiting
from compare.stability.place import Posture, in_the_air_at, standing_at
from compare.stability.rest import NEAR_REST

SPEEDING = '<general joint="turn" biastype="affine" biasprm="0 0 1"/>'  # force = speed
PUSHING = '<general joint="turn" biastype="affine" biasprm="0 20 0"/>'  # away from its zero
POLE = """<mujoco><option timestep="0.002"/><worldbody><body><joint name="a" axis="0 1 0" damping="0.05" {}/>
  <geom size="0.05" pos="0 0 0.5" mass="1"/></body></worldbody></mujoco>"""
STONE = """<mujoco><option timestep="0.002"/><worldbody>{}<body pos="0 0 1"><freejoint/><geom size="0.1" mass="1"/></body>
  </worldbody></mujoco>"""
FLOOR = '<geom type="plane" size="2 2 0.1"/>'


def test_a_rest_is_where_a_step_leaves_the_speeds_as_they_are():
    for text in (KINDS["servos"], KINDS["a limit"], KINDS["elliptic, condim 3"], LEG):
        for integrator in INTEGRATORS:
            rest = rest_of(text, 2e-3, integrator)
            before = rest.speeds
            assert rest.left < 1e-4 and np.abs(rest.accelerations).max() == pytest.approx(rest.left)
            rest.step.next(rest.state)
            assert np.abs(rest.step.data.qvel - before).max() < 1e-7


def test_the_rest_depends_on_the_step_where_contacts_are_softened():
    """Below two steps MuJoCo takes a longer time constant: the foot sinks deeper."""
    place = place_of(LEG)
    fine, coarse = (rest_of(LEG, dt).state for dt in (1e-3, 0.03))
    deeper = np.abs(fine - coarse).max()
    assert 1e-5 < deeper < 0.1 and place.surroundings == "contact" and place.is_touching


def test_a_saddle_is_left_where_it_leads_to_a_rest():
    hanging = place_of(POLE.format(""))
    assert not hanging.has_fallen  # its base is fixed
    assert abs(abs(hanging.moved[0]) - np.pi) < 0.1 and limit_of(POLE.format("")).kind == "none"
    stopped = place_of(POLE.format('range="-20 30" limited="true"'))
    assert abs(stopped.moved[0]) > 0.3
    assert limit_of(POLE.format('range="-20 30" limited="true"')).kind != "saddle"


@pytest.mark.parametrize("actuator, rate", [(SPEEDING, 1.0 / INERTIA), (PUSHING, np.sqrt(20.0 / INERTIA))])
def test_a_saddle_that_leads_nowhere_is_told_with_its_rate(actuator, rate):
    for integrator in ("Euler", "implicitfast", "RK4"):
        found = limit_of(hinge(actuator=actuator), integrator)
        assert (found.kind, found.dt) == ("saddle", None)
        assert found.growth.rate == pytest.approx(rate, rel=0.02)


def test_what_falls_has_no_rest_and_one_in_the_air_has():
    falling, lying = place_of(STONE.format("")), place_of(STONE.format(FLOOR))
    assert falling.left == pytest.approx(9.81) and falling.surroundings == "free" and not falling.is_touching
    assert limit_of(STONE.format("")).kind == "no_rest"
    assert in_the_air_at(falling).left < NEAR_REST
    assert lying.has_fallen and lying.is_touching and lying.moved[2] == pytest.approx(-0.9, abs=1e-3)
    assert limit_of(STONE.format(FLOOR)).kind == "none"
    assert in_the_air_at(place_of(hinge())) is None  # nothing touches it, and it rests


def test_in_the_air_a_base_that_would_fall_has_no_weight_and_a_fixed_one_has():
    """A base falls that has a free joint, or slides downwards with nothing on its joint."""
    hanging = LEG.replace('name="lift"', 'name="lift" stiffness="900"')
    for text, weightless in ((BOX, True), (CASTER, True), (LEG, True), (hanging, False)):
        air = in_the_air_at(place_of(text))
        assert (air.surroundings, air.is_touching) == ("air", False)
        assert (not air.model.opt.gravity.any()) is weightless
    assert place_of(LEG).model.opt.gravity.any()
    assert np.flatnonzero(rest_of(BOX).is_held).tolist() == [2, 3, 4]  # it slides and turns on its floor


def test_what_limits_is_named_with_its_contact():
    text = STANDING.format(cone="elliptic", condim=3)
    found = limit_of(text, "implicitfast")
    assert limiting(place_of(text), found.rest, found.growth) == ("z", "floor on foot")
    found = limit_of(KINDS["servos"])
    named = limiting(place_of(KINDS["servos"]), found.rest, found.growth)
    assert named == ("k", "")
    stable = limit_of(KINDS["a box"])
    assert limiting(place_of(KINDS["a box"]), stable.rest, stable.growth) == ("", "")


@pytest.mark.parametrize(
    "cone, counts", [("elliptic", {1: 1, 3: 3, 6: 6}), ("pyramidal", {1: 1, 3: 4, 6: 10})]
)
def test_all_rows_of_a_contact_are_its_own(cone, counts):
    for condim, count in counts.items():
        rest = rest_of(STANDING.format(cone=cone, condim=condim))
        assert rows_at(rest.step, rest.state)[1].contact.tolist() == [0] * count
    rest = rest_of(KINDS["a limit"])
    assert rows_at(rest.step, rest.state)[1].contact.tolist() == [-1]


def test_a_relaxed_run_loses_its_speed_whether_anything_brakes_or_not():
    place = place_of(POLE.format("").replace('damping="0.05"', ""))
    step = Step(place.model, 1e-3, "Euler")
    start = step.moved(place.rest, np.array([0.5, 0.0]))
    for rate, slow in ((4.0, True), (0.0, False)):
        step.put(step.relaxed(start, 3.0, rate, 1e-9))
        assert bool(abs(step.data.qvel[0]) < 0.02) is slow


def test_a_posture_may_be_numbers():
    reading = read(KINDS["servos"])
    place = standing_at(reading, Posture("mine", "", (0.2, -0.1)))
    data = place.start[1:3]
    assert data == pytest.approx([0.2, -0.1]) and np.abs(place.moved).max() < 0.2


def test_what_bounces_is_not_in_the_air():
    """A light box on a stiff floor never rests at 2 ms: its floor stays, and the step is not stable."""
    box = BOX.replace('mass="2"', 'mass="1e-6"')
    box = box.replace("<worldbody>", '<default><geom solref="-1e5 -100"/></default><worldbody>')
    place = place_of(box)
    assert place.surroundings == "contact"
    row, _ = limit_row(place, "Euler", Asked(2e-3, "Euler", ["Euler"], in_runs=True))
    assert row.limit == "moving" and row.stable_at_file_dt is False and 1e-4 < row.longest < 2e-3


def test_a_loose_object_that_moves_on_is_named_and_hides_nothing():
    ball = '<body name="ball" pos="0 0 5"><freejoint/><geom size="0.1"/></body></worldbody>'
    text = hinge(20.0, 5.0).replace("</worldbody>", ball)
    place = place_of(text)
    assert place.held_objects == "ball" and not place_of(hinge()).held_objects
    assert limit_row(place, "Euler", Asked(2e-3, "Euler", ["Euler"]))[0].base == "fixed"  # it does not stand
    assert limit_of(text).dt == pytest.approx(limit_of(hinge(20.0, 5.0)).dt, rel=3e-3)
    tail = '<body><joint axis="0 1 0"/><geom size="0.1" pos="0.2 0 0"/></body></body></worldbody>'
    assert not place_of(text.replace("</body></worldbody>", tail)).held_objects  # a robot is none
