"""Records for experiments that need none of a machine."""

import pytest

from classifier.dataset import Dataset
from datagen.recipes import Recipe
from tests.ringing import ringing


@pytest.fixture(scope="session")
def dataset() -> Dataset:
    return ringing()


@pytest.fixture(scope="session")
def table2() -> Recipe:
    """Three records of each class in each subset, just long enough for a PSD of 1 Hz."""
    return Recipe("small", ("campaign=table2", "count=54", "run.samples=1200"))
