"""The stages in one process on the real bus, with trivial answers; the seed says what becomes of a path."""

from __future__ import annotations

import argparse
import struct
import time
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from typing import Any

import msgspec
from shapely import LineString

from oxbow.bus import Envelope, Session
from oxbow.bus.query import MSGPACK, Query
from oxbow.contracts import (
    ASSIGN,
    CERTIFY,
    CONTOUR,
    DECOMPOSE,
    PATH,
    Assignment,
    AssignRequest,
    Certificate,
    CertifyRequest,
    ContourRequest,
    DecomposeRequest,
    Decomposition,
    Endpoint,
    FreeSpace,
    Message,
    PathPlan,
    PathRequest,
    Sortie,
)
from oxbow.errors import ErrorReply, Infeasible, Internal, OxbowError, error_text
from oxbow.runtime.lifetime import Lifetime
from oxbow.wire import codec
from oxbow.wire.envelope import StageError
from tests.support.mission_files import BROKEN_SEED, INFEASIBLE_SEED, POISON_SEED


def contour(request: ContourRequest) -> FreeSpace:
    return FreeSpace(free=request.outline, water=request.outline, tolerance_m=1.0, compression=1.0)


def assign(request: AssignRequest) -> Assignment:
    vehicle, spots = request.vehicles[0], request.hot_spots
    path = LineString([vehicle.start, *(spot.area.centroid for spot in spots), vehicle.recovery])
    sortie = Sortie(
        vehicle=vehicle.name,
        path=path,
        hot_spots=tuple(spot.name for spot in spots),
        length_m=path.length,
        duration_s=path.length / vehicle.speed_mps,
    )
    return Assignment(sorties=(sortie,), treated_share=(1.0,) * len(spots), makespan_s=sortie.duration_s)


def decompose(_request: DecomposeRequest) -> Decomposition:
    return Decomposition(heading_rad=0.0, cells=(), critical_points=())


def path(request: PathRequest) -> PathPlan:
    if request.seed == INFEASIBLE_SEED:
        raise Infeasible("no water is left", where="path")
    if request.seed == BROKEN_SEED:
        raise ZeroDivisionError("a fault of the stage")
    time.sleep(request.seed / 1000)
    (x, y), end = request.launch, request.recovery
    return PathPlan(path=LineString([(x, y), (x + 10.0, y), (x + 10.0, y + 10.0), end]), spacing_m=10.0, steps=())


def certify(request: CertifyRequest) -> Certificate:
    return Certificate(
        length_m=request.path.length,
        duration_s=request.path.length / request.speed_mps,
        waypoints=len(request.path.coords),
        is_simple=True,
        crossings=0,
        outside_m=0.0,
        unsafe_m=0.0,
        components=1,
        free_area_m2=request.outline.area,
        judged_area=1.0,
        cover_radius_m=(1.0, 2.0),
        least_radius_m=1.0,
        q=2.0,
        mean_distance_m=1.0,
        p95_distance_m=1.0,
        mean_ratio=1.0,
        p95_ratio=1.0,
        request_digest=codec.digest(request),
    )


def answering(
    endpoint: Endpoint[Any, Any], handle: Callable[[Any], Message], pool: Executor
) -> Callable[[Query], object]:
    key = endpoint.instance_key("trivial")

    def answer(query: Query) -> None:
        request_id = Envelope.decode(query.attachment).request_id
        with query:
            try:
                request = codec.decode(query.payload, endpoint.request)
                reply = NESTED if getattr(request, "seed", 0) == POISON_SEED else codec.encode(handle(request))
                query.reply(key, reply, encoding=MSGPACK, attachment=request_id.encode())
            except Exception as error:  # noqa: BLE001 - as a stage does
                known = error if isinstance(error, OxbowError) else Internal(error_text(error), where=key)
                query.fail(StageError.about(request_id, ErrorReply.of(known)))

    return lambda query: pool.submit(answer, query)


NESTED = msgspec.msgpack.encode(
    {"path": struct.pack("<BII", 1, 7, 1) * 200_000 + struct.pack("<BII", 1, 2, 0), "spacing_m": 10.0, "steps": []}
)
"""The reply of a path stage, with collections in one another as its path: libraries run out of stack over it."""


HANDLERS: tuple[tuple[Endpoint[Any, Any], Callable[[Any], Message]], ...] = (
    (CONTOUR, contour),
    (ASSIGN, assign),
    (DECOMPOSE, decompose),
    (PATH, path),
    (CERTIFY, certify),
)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--connect", required=True)
    parser.add_argument("--parent", type=int)
    options = parser.parse_args()
    lifetime = Lifetime(options.parent)
    with ThreadPoolExecutor(4) as pool, Session.connect(options.connect) as session:
        for endpoint, handle in HANDLERS:
            session.declare_queryable(endpoint.instance_key("trivial"), answering(endpoint, handle, pool))
            session.declare_live(endpoint.live_key("trivial"))
        lifetime.wait()


if __name__ == "__main__":
    main()
