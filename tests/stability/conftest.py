import pytest

from compare.core.check import Result


@pytest.fixture
def result():
    return Result("stability")
