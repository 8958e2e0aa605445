"""Models that are not the stated arm: nothing raises, and every sentence follows that model's numbers."""

import pytest
from edited import MODELS, XML, setup_of

from compare.experiments import acceleration, gravity, kinematics, mass, published


@pytest.mark.parametrize("name", MODELS)
def test_the_static_experiments_say_what_they_find(name):
    setup = setup_of(XML.replace(*MODELS[name]) if name != "the arm" else XML)
    for module in (published, kinematics, mass, gravity, acceleration):
        result = module.rows(setup)
        texts = [*result.notes, *(figure()[2] for figure in module.figures(result, setup.robot))]
        assert all(text.endswith(".") and "nan" not in text for text in texts)
        if name == "the arm":
            assert all(check.passed for check in result.checks)
