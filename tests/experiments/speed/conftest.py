import pytest

from compare.robots.arm import ARM
from compare.truth.reference import reference


@pytest.fixture(scope="session")
def bent():
    """The arm's scene in which errors fall regularly."""
    return next(case for case in ARM.cases if case.name == "bent, free")


@pytest.fixture(scope="session")
def known_reference(bent):
    """Its run with many digits, in pairs of doubles."""
    return reference(bent)
