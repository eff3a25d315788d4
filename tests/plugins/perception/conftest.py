"""The network that is shipped."""

import pytest
from hecbench_plugins.networks.ur import WEIGHTS
from hecbench_plugins.perception.model import PerceptionModel


@pytest.fixture(scope="session")
def network():
    return PerceptionModel(WEIGHTS)
