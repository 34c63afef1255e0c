"""A message of every kind, for docs/bus.md to show."""

from __future__ import annotations

import msgspec
import numpy as np
from shapely import LineString, Point, box

from oxbow.contracts import (
    Assignment,
    AssignRequest,
    Cell,
    Certificate,
    CertifyRequest,
    ContourRequest,
    CriticalKind,
    CriticalPoint,
    DecomposeRequest,
    Decomposition,
    DroppedPart,
    FreeSpace,
    HeadingScore,
    HotSpot,
    MissionState,
    MissionStatus,
    PathPlan,
    PathRequest,
    Sortie,
    SpacingStep,
    Vehicle,
)
from oxbow.errors import ErrorCode, ErrorReply
from oxbow.planning.submission import SubmissionParameters
from oxbow.wire.envelope import Envelope
from oxbow.wire.introspection import Info, Ping, Stats, Supervised, Supervision
from oxbow.wire.recording import Layer, Stamped

__all__ = ["EXAMPLES"]

TIME_S = 1_760_000_000.0

SQUARE = box(0.0, 0.0, 100.0, 60.0)
SPACE = FreeSpace(free=box(5.0, 5.0, 95.0, 55.0), water=SQUARE, tolerance_m=1.0, compression=0.25)
DECOMPOSITION = Decomposition(
    heading_rad=0.0,
    cells=(
        Cell(
            floor=np.array([[5.0, 5.0], [95.0, 5.0]]),
            ceiling=np.array([[5.0, 55.0], [95.0, 55.0]]),
            start=0,
            end=1,
        ),
    ),
    critical_points=(
        CriticalPoint(kind=CriticalKind.OPEN, place=(5.0, 5.0)),
        CriticalPoint(kind=CriticalKind.CLOSE, place=(95.0, 5.0)),
    ),
    scores=(HeadingScore(heading_rad=0.0, predicted_cost=0.052),),
)
PATH = LineString([(5.0, 5.0), (5.0, 55.0), (50.0, 55.0), (50.0, 15.0), (95.0, 15.0), (95.0, 5.0), (5.0, 5.0)])
SORTIE = LineString([(5.0, 5.0), (20.0, 25.0), (40.0, 25.0), (5.0, 5.0)])

EXAMPLES: dict[type[msgspec.Struct], msgspec.Struct] = {
    type(example): example
    for example in (
        Envelope(
            request_id="0f5c1c2e",
            deadline_s=TIME_S + 60.0,
            mission_id="lake",
            run_id="77ab30d1",
            origin=(46.09, 1.9),
        ),
        ErrorReply(code=ErrorCode.INFEASIBLE, message="nothing is left of the water", where="Safety"),
        ContourRequest(outline=SQUARE, zones=(box(40.0, 20.0, 60.0, 40.0),), safety_m=5.0, spacing_m=20.0),
        DroppedPart(
            area_m2=42.0, reason="apart from the largest water", place=(3.0, 4.0), outline=box(0, 0, 6, 7)
        ),
        SPACE,
        AssignRequest(
            free=SPACE.free,
            vehicles=(Vehicle(name="tern", length_m=2_000.0, start=(5.0, 5.0), recovery=(5.0, 5.0)),),
            hot_spots=(HotSpot(name="features[0]", area=box(20.0, 20.0, 40.0, 30.0), value=12.0),),
            swath_m=10.0,
        ),
        Assignment(
            sorties=(
                Sortie(
                    vehicle="tern",
                    path=SORTIE,
                    hot_spots=("features[0]",),
                    length_m=SORTIE.length,
                    duration_s=SORTIE.length,
                ),
            ),
            treated_share=(1.0,),
            makespan_s=SORTIE.length,
        ),
        DecomposeRequest(free=SPACE.free, spacing_m=20.0),
        DECOMPOSITION,
        PathRequest(
            space=SPACE, decomposition=DECOMPOSITION, launch=(5.0, 5.0), recovery=(5.0, 5.0), length_m=20_000.0
        ),
        PathPlan(path=PATH, spacing_m=45.0, steps=(SpacingStep(spacing_m=45.0, length_m=PATH.length),)),
        CertifyRequest(outline=SQUARE, safety_m=5.0, path=PATH, launch=(5.0, 5.0), recovery=(5.0, 5.0)),
        Certificate(
            length_m=280.0,
            duration_s=280.0,
            waypoints=7,
            is_simple=True,
            crossings=0,
            outside_m=0.0,
            unsafe_m=0.0,
            components=1,
            free_area_m2=4500.0,
            judged_area=1.0,
            cover_radius_m=(40.0, 40.4),
            least_radius_m=7.7,
            q=5.24,
            mean_distance_m=9.8,
            p95_distance_m=27.3,
            mean_ratio=2.55,
            p95_ratio=3.54,
            p99_distance_m=35.3,
            p99_ratio=4.59,
            least_leg_distance_m=10.0,
            discrepancy=0.25,
            discrepancy_ratio=1.7,
            request_digest="9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08",
            directional_evenness=0.44,
            turns=5,
            worst_gap=(92.2, 55.0),
        ),
        MissionStatus(
            mission_id="lake",
            revision=1,
            state=MissionState.PLANNING,
            stage="path",
            fraction=0.5,
            time_s=TIME_S,
        ),
        SubmissionParameters(id="lake", seed=3, deadline_s=60.0),
        Ping(stage="path", instance="r1", pid=4242, uptime_s=12.5),
        Info(
            stage="path",
            instance="r1",
            version="0.1.0",
            handler="oxbow_path.service:handle",
            started_s=TIME_S,
            worker_pid=4243,
        ),
        Stats(
            stage="path",
            instance="r1",
            served=120,
            failed=2,
            busy=0,
            queued=1,
            mean_s=0.8,
            p95_s=1.6,
            worker_restarts=0,
            session_rss_bytes=48 * 10**6,
            worker_rss_bytes=110 * 10**6,
        ),
        Supervision(
            instance="4200",
            processes=(Supervised(name="path-1", pid=4242, starts=2, trouble="ended with status -9"),),
        ),
        Stamped(
            mission_id="lake",
            origin=(46.09, 1.9),
            request_id="77ab30d1",
            time_s=TIME_S,
            layer=Layer(stage="path", name="launch", geometries=(Point(5.0, 5.0),), labels=("launch",)),
        ),
    )
}
