"""What may leave the path stage, and what is stopped."""

import pytest
from msgspec.structs import replace
from shapely import LineString, box

from oxbow.contracts import PathRequest
from oxbow.errors import Internal
from oxbow_path.conformance import require_conforming
from tests.support.path_requests import request

WATER = box(0, 0, 1000, 600)


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ([(0, 300), (500, 500), (500, 100), (100, 500), (0, 301)], "crosses itself"),
        ([(0, 300), (600, 300), (600, 599), (500, 599), (500, 301), (0, 301)], "leaves the free space"),
        (
            [(0, 300), (985, 300.5), *((20 + 10 * k, (320, 580)[k % 2]) for k in range(95, -1, -1)), (0, 301)],
            "m long",
        ),
    ],
    ids=["crossing", "outside", "too-long"],
)
def test_what_must_not_leave_the_stage_is_stopped(path, message):
    asked = request(WATER, spacings=15, launch=(0.0, 300.0), recovery=(0.0, 301.0))
    with pytest.raises(Internal, match=message):
        require_conforming(LineString(path), asked)


def test_a_sound_path_passes_up_to_each_rule():
    asked: PathRequest = request(WATER, spacings=15, launch=(0.0, 300.0), recovery=(0.0, 301.0))
    east = asked.space.free.bounds[2]
    path = LineString([(0, 300), (east, 300), (east, 310), (0, 301)])
    require_conforming(path, asked)
    require_conforming(path, replace(asked, length_m=path.length))
    with pytest.raises(Internal, match="m long"):
        require_conforming(path, replace(asked, length_m=0.999 * path.length))
    with pytest.raises(Internal, match="leaves the free space"):
        require_conforming(LineString([(0, 300), (east + 0.1, 300), (east, 310), (0, 301)]), asked)
