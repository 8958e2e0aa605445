import pytest

from compare.experiments.stability.tables import StabilityResult


@pytest.fixture
def result():
    return StabilityResult("stability")
