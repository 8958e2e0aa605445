import pytest

from compare.experiments.stability.rows import StabilityResult


@pytest.fixture
def result():
    return StabilityResult("stability")
