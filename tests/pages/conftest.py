"""The small scene of most tests, set up for the live page."""

import pytest
from scenes import TITLED, load_text

from fem_impact.pages import explore_model, explore_numbers


@pytest.fixture(scope="module")
def stand(tmp_path_factory):
    return explore_model.Setup.of(load_text(tmp_path_factory.mktemp("setup"), TITLED))


@pytest.fixture(scope="module")
def explorer(stand):
    return explore_numbers.Explorer(stand)
