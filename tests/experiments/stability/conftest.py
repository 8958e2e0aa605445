import pytest

from compare.judge.check import Result


@pytest.fixture
def result():
    return Result("stability")
