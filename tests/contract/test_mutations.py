"""Messages that are wrong are refused by name: no exception of a library, and no end of the process."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Any

import pytest
import shapely
from shapely import Polygon

from oxbow.contracts import (
    STAGES,
    AssignRequest,
    CertifyRequest,
    ContourRequest,
    DecomposeRequest,
    Endpoint,
    HotSpot,
    Message,
    Method,
    PathRequest,
    Role,
    Vehicle,
    WeightedArea,
)
from oxbow.errors import Infeasible, InvalidRequest
from oxbow.wire import codec
from oxbow.wire.recording import discard
from oxbow_cli.local import local_call
from tests.support.mutations import mutated

CHEAP = ("contour", "decomposition", "certificate")
OUTLINE = Polygon([(0, 0), (60, 0), (70, 30), (40, 55), (0, 50)])
PLACE = (5.0, 5.0)


@dataclass(frozen=True)
class Exchange:
    """A request to a stage and its reply, as they travel."""

    endpoint: Endpoint[Any, Any]
    request: bytes
    reply: bytes


@pytest.fixture(scope="module")
def exchanges() -> list[Exchange]:
    """One exchange with each stage, about a pond with an island."""
    found: list[Exchange] = []
    call = local_call()

    def ask(request: Message) -> Any:
        [endpoint] = [each for each in STAGES if each.request is type(request)]
        reply = call(endpoint, request)
        found.append(Exchange(endpoint, codec.encode(request), codec.encode(reply)))
        return reply

    island = shapely.box(25.0, 20.0, 30.0, 25.0)
    space = ask(ContourRequest(outline=OUTLINE, zones=(island,), safety_m=2.0, spacing_m=6.0))
    cells = ask(DecomposeRequest(free=space.free, spacing_m=6.0))
    vehicles = tuple(
        Vehicle(name=role, role=role, length_m=1000.0, start=PLACE, recovery=PLACE)
        for role in (Role.MASTER, Role.SLAVE)
    )
    spot = HotSpot(name="bloom", area=shapely.box(35.0, 20.0, 45.0, 30.0), value=2.0)
    ask(
        AssignRequest(
            free=space.free, water=space.water, vehicles=vehicles, share_free=True, hot_spots=(spot,), swath_m=4.0
        )
    )
    plan = ask(
        PathRequest(
            method=Method.TRANSECT,
            space=space,
            decomposition=cells,
            launch=PLACE,
            recovery=PLACE,
            length_m=500.0,
            weighted_areas=(WeightedArea(area=spot.area, weight=2.0),),
        )
    )
    ask(
        CertifyRequest(
            path=plan.path, launch=PLACE, recovery=PLACE, outline=OUTLINE, zones=(island,), safety_m=2.0
        )
    )
    return found


def test_a_mutated_message_is_one_or_is_refused(exchanges: list[Exchange]) -> None:
    chance = random.Random(1)
    messages = [(each.endpoint.request, each.request) for each in exchanges]
    messages += [(each.endpoint.reply, each.reply) for each in exchanges]
    refused = 0
    for _ in range(5_000):
        kind, message = chance.choice(messages)
        try:
            codec.decode(mutated(message, chance), kind)
        except InvalidRequest as error:
            refused += 1
            assert error.where
    assert refused > 2_500


def test_a_stage_plans_a_mutated_request_or_says_what_is_wrong(exchanges: list[Exchange]) -> None:
    chance = random.Random(2)
    call, planned = local_call(), 0
    for _ in range(120):
        exchange = chance.choice([each for each in exchanges if each.endpoint.stage in CHEAP])
        try:
            request = codec.decode(mutated(exchange.request, chance), exchange.endpoint.request)
            codec.encode(call.handlers[exchange.endpoint.stage](request, discard))
        except (InvalidRequest, Infeasible):
            continue
        planned += 1
    assert planned > 12
