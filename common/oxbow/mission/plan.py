"""What a plan is asked for and what is recorded of it: the options, and the `Plan` object of a Mission File."""

from __future__ import annotations

from oxbow.contracts import (
    MOST_DEADLINE_S,
    MOST_SEED,
    Conformance,
    Draw,
    LeftSpot,
    Measures,
    Message,
    Method,
    Role,
    RouteMethod,
    require_finite,
)
from oxbow.geometry.frame import Position

__all__ = [
    "DroppedWater",
    "FleetRecord",
    "FurtherSortie",
    "PlanCertificate",
    "PlanOptions",
    "PlanRecord",
    "TreatedSpot",
    "TreatmentRecord",
    "VehicleRecord",
]


class PlanOptions(Message, frozen=True, kw_only=True):
    """How to plan, beside what the Mission File says; a heading or tolerance left out is chosen by the planner.

    `time_limit_s` is how long the path method may spend on improving the path. By default it does a fixed amount
    of work, so that the same request gives the same plan on every machine; with a limit it stops earlier, and
    the plan depends on the machine. `smooth` asks for rounded corners; `draw` matters to the space-filling curve,
    and `router` to treatments: it is how routes to, between and from hot spots are found.
    """

    method: Method = Method.SPACE_FILLING_CURVE
    seed: int = 0
    heading_rad: float | None = None
    tolerance_m: float | None = None
    time_limit_s: float | None = None
    smooth: bool = False
    draw: Draw = Draw.LOW_DISCREPANCY
    router: RouteMethod = RouteMethod.VISIBILITY

    def __post_init__(self) -> None:
        require_finite(self, "heading_rad")
        require_finite(self, "time_limit_s", above=0.0, most=MOST_DEADLINE_S)
        require_finite(self, "seed", least=0, most=MOST_SEED)
        require_finite(self, "tolerance_m", least=0.0)


class PlanCertificate(Measures, frozen=True, kw_only=True):
    """The certificate as the Mission File keeps it: the worst gap in degrees."""

    worst_gap: Position | None = None


class DroppedWater(Message, frozen=True, kw_only=True):
    """Water that the plan leaves out, why, and a place in it."""

    area_m2: float
    reason: str
    place: Position


class VehicleRecord(Message, frozen=True, kw_only=True):
    """What one vehicle of a fleet is to do; `length_m` is the geodesic length of its waypoints as written.

    Heading, spacing and the area of its share of the free space are those of a survey, `hot_spots` those that it
    treats, in order.
    """

    name: str
    role: Role
    length_m: float
    max_length_m: float
    duration_s: float
    heading_deg: float | None = None
    spacing_m: float | None = None
    area_m2: float | None = None
    hot_spots: tuple[str, ...] = ()
    certificate: Conformance


class FleetRecord(Message, frozen=True, kw_only=True):
    """What several vehicles are to do.

    `makespan_s` is when the last of them is done; `imbalance` is the largest deviation of a share's area from what
    is due to its vehicle, as a part of that.
    """

    makespan_s: float
    imbalance: float
    vehicles: tuple[VehicleRecord, ...]


class TreatedSpot(Message, frozen=True, kw_only=True):
    """A hot spot, its value, and how much of its area in the free space the sorties treat, 0 to 1."""

    hot_spot: str
    value: float
    treated_share: float


class FurtherSortie(Message, frozen=True, kw_only=True):
    """A sortie proposed for hot spots that the first ones leave: by the same vehicle, from its start again."""

    vehicle: str
    hot_spots: tuple[str, ...]
    length_m: float
    duration_s: float
    path: tuple[Position, ...]


class TreatmentRecord(Message, frozen=True, kw_only=True):
    """Which hot spots are treated, which are left for further sorties, and which no sortie can treat, and why.

    `router` is how routes to, between and from hot spots were found.
    """

    swath_m: float
    hot_spots: tuple[TreatedSpot, ...]
    further: tuple[FurtherSortie, ...] = ()
    left: tuple[LeftSpot, ...] = ()
    joint_gap: float | None = None
    router: RouteMethod = RouteMethod.VISIBILITY


class PlanRecord(Message, frozen=True, kw_only=True):
    """The `Plan` object of a completed Mission File: how the paths were made and how good they are.

    It is about the masters' paths, or the slaves' where there is no master; of several paths, lengths are sums,
    `duration_s` is the longest, `spacing_m` the widest, and `heading_deg` is set where all have the same.
    `fleet` describes each vehicle, unless one surveys alone, and `treatment` the hot spots; `slave_certificate` is
    that of the slaves' paths where there are masters too.

    Transects run along `heading_deg` (clockwise from north). `length_m` is the geodesic length of the
    waypoints as written. The same mission, options and versions give the same plan, unless there was a
    `time_limit_s`. `mission_id` and `revision` are those that the mission service keeps the plan under; they are
    None in a plan made without it.
    """

    method: Method
    seed: int
    time_limit_s: float | None = None
    heading_deg: float | None = None
    spacing_m: float
    length_m: float
    max_length_m: float
    duration_s: float
    tolerance_m: float
    compression: float
    certificate: PlanCertificate
    versions: dict[str, str]
    warnings: tuple[str, ...] = ()
    dropped: tuple[DroppedWater, ...] = ()
    fleet: FleetRecord | None = None
    treatment: TreatmentRecord | None = None
    slave_certificate: PlanCertificate | None = None
    mission_id: str | None = None
    revision: int | None = None
