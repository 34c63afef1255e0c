"""Which requests are the same, and what parameters may say."""

from __future__ import annotations

import json
import re
from typing import Any
from urllib.parse import unquote

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oxbow.contracts import Method, checked_id
from oxbow.errors import InvalidRequest
from oxbow.mission.file import Position
from oxbow.planning.submission import Submission, SubmissionParameters

LAKE: dict[str, Any] = {
    "MissionType": "map",
    "SiteName": "Lac d'Essai",
    "LaunchPoint": {"lat": 45.0, "long": 5.0},
    "BoundingBox": [{"lat": 44.9, "long": 4.9}, {"lat": 44.9, "long": 5.1}, {"lat": 45.1, "long": 5.0}],
    "Colour": "blue",
}


def submission(**parameters: str) -> Submission:
    return Submission.parse(json.dumps(LAKE).encode(), parameters)


def test_layout_and_an_earlier_plan_make_no_difference() -> None:
    plain = submission()
    assert Submission.parse(json.dumps(LAKE, indent=7).encode(), {}).fingerprint == plain.fingerprint
    replanned = msgspec.structs.replace(plain.mission, master_path=(Position(lat=45.0, long=5.0),))
    assert Submission(replanned).fingerprint == plain.fingerprint


@pytest.mark.parametrize("change", [{"SiteName": "Lac"}, {"Colour": "green"}, {"Safety": 1}])
def test_content_makes_a_difference(change: dict[str, Any]) -> None:
    assert Submission.parse(json.dumps(LAKE | change).encode(), {}).fingerprint != submission().fingerprint


def test_options_make_a_difference_but_not_the_id_or_the_deadline() -> None:
    assert submission(seed="1").fingerprint != submission().fingerprint
    assert submission(router="funnel").fingerprint != submission().fingerprint
    assert submission(heading_rad="0.5").fingerprint != submission().fingerprint
    assert submission(time_limit_s="5").fingerprint != submission().fingerprint
    assert submission(deadline_s="7", id="lake").fingerprint == submission().fingerprint


def test_the_id_is_readable_and_names_the_content() -> None:
    assert re.fullmatch(r"Lac-d-Essai-[0-9a-f]{8}", submission().mission_id)
    assert submission(seed="1").mission_id != submission().mission_id
    assert submission(id="lake").mission_id == "lake"


@settings(max_examples=100)
@given(st.text())
def test_any_site_name_makes_an_id(site_name: str) -> None:
    mission = msgspec.structs.replace(submission().mission, site_name=site_name)
    assert len(checked_id(Submission(mission).mission_id)) <= 60


def test_a_site_name_that_begins_with_a_dot_makes_an_id() -> None:
    mission = msgspec.structs.replace(submission().mission, site_name="..")
    assert re.fullmatch(r"mission-[0-9a-f]{8}", Submission(mission).mission_id)


parameters = st.builds(
    SubmissionParameters,
    method=st.sampled_from(Method),
    seed=st.integers(0, 2**53),
    heading_rad=st.none() | st.floats(-10, 10),
    tolerance_m=st.none() | st.floats(0, 1e6),
    time_limit_s=st.none() | st.floats(1e-3, 86_400),
    id=st.none() | st.from_regex(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,127}", fullmatch=True),
    deadline_s=st.floats(1e-3, 86_400),
)


@settings(max_examples=200)
@given(parameters)
def test_parameters_survive_the_way_through_a_selector(given_parameters: SubmissionParameters) -> None:
    pairs = (part.split("=") for part in given_parameters.text.split(";") if part)
    assert SubmissionParameters.parse({name: unquote(value) for name, value in pairs}) == given_parameters


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"sed": "1"}, "^parameters: has 'sed'; expected method, seed, .*, client and nothing else$"),
        ({"seed": "many"}, "^seed: is 'many'; expected a whole number$"),
        ({"seed": "1.5"}, "^seed: is '1.5'; expected a whole number$"),
        (
            {"method": "Spiral"},
            "^method: is 'Spiral'; expected one of SpaceFillingCurve, Tour, Transect, Watershed$",
        ),
        ({"router": "compass"}, "^router: is 'compass'; expected one of visibility, "),
        ({"draw": "x"}, "^draw: is 'x'; expected one of low-discrepancy, "),
        ({"smooth": "maybe"}, "^smooth: is 'maybe'; expected true or false$"),
        ({"heading_rad": "north"}, "^heading_rad: is 'north'; expected a finite number$"),
        ({"method": "x" * 10**6}, r"^method: is 'x+'... \(1000000 characters\); expected one of "),
        ({"deadline_s": "0"}, "deadline_s: is 0.0"),
        ({"deadline_s": "nan"}, "deadline_s: is nan"),
        ({"deadline_s": "inf"}, "deadline_s: is inf"),
        ({"deadline_s": "1e308"}, r"deadline_s: is 1e\+308; expected .* at most 86400"),
        ({"deadline_s": "3e6"}, "deadline_s: is 3000000.0; expected .* at most 86400"),
        ({"time_limit_s": "3e6"}, "time_limit_s: is 3000000.0; expected .* at most 86400"),
        ({"seed": "1" + 400 * "0"}, "seed: is an integer of 1329 bits"),
        ({"seed": "1" + 5000 * "0"}, "seed"),
        ({"x" * 10**6: "1"}, r"^parameters: has 'x+'... \(1000000 characters\); expected method, seed"),
        ({"seed": "-1"}, "seed: is -1"),
        ({"time_limit_s": "0"}, "time_limit_s: is 0.0"),
        ({"id": "a/b"}, "id: is 'a/b'"),
        ({"id": "*"}, r"id: is '\*'"),
    ],
)
def test_what_is_wrong_with_parameters_is_told(parameters: dict[str, str], message: str) -> None:
    with pytest.raises(InvalidRequest, match=message) as raised:
        submission(**parameters)
    assert len(str(raised.value)) < 1000
    assert "`" not in str(raised.value)
