"""MuJoCo and tmt have the same numbers of any tree."""

from engines.drawn_trees import drawn_trees, mjcf_of
from files import assert_the_same, case_of
from hypothesis import given, settings

from compare.engines.mujoco import engine, read


@settings(max_examples=25)
@given(drawn_trees(as_mjcf=True))
def test_every_quantity_of_a_random_tree_is_the_same_in_both(drawn):
    tree = drawn.tree
    reading = read(mjcf_of(tree))
    assert reading.tree.hinge_names == tree.hinge_names and reading.tree.parent == tree.parent
    assert_the_same(engine(reading).of(case_of(tree)), tree, drawn.rng, states=2)
