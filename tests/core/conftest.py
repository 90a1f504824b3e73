import pytest
from places import PLACES, Place


@pytest.fixture(params=PLACES, ids=list(PLACES))
def place(request):
    return Place(*PLACES[request.param])
