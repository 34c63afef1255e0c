"""Every message between Oxbow's processes, and the endpoints that exchange them.

All geometry is planar, in metres, in the mission's local frame (`oxbow.frame`): x east, y north.
A message that exists is valid: `__post_init__` enforces its invariants on both sides of the bus.
Key expressions stand here and nowhere else.
"""

from __future__ import annotations

import enum
import math
import re
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import msgspec
import numpy as np
import numpy.typing as npt
from shapely import LineString, Polygon

from oxbow.errors import ErrorReply, InvalidMission

__all__ = [
    "ASSIGN",
    "CERTIFY",
    "CONTOUR",
    "DECOMPOSE",
    "PATH",
    "STAGES",
    "AssignRequest",
    "Assignment",
    "Cell",
    "Certificate",
    "CertifyRequest",
    "Conformance",
    "ContourRequest",
    "CriticalKind",
    "CriticalPoint",
    "DecomposeRequest",
    "Decomposition",
    "DroppedPart",
    "Endpoint",
    "FloatArray",
    "FreeSpace",
    "HeadingScore",
    "HotSpot",
    "LeftSpot",
    "Measures",
    "Message",
    "Method",
    "MissionKey",
    "MissionState",
    "MissionStatus",
    "PathPlan",
    "PathRequest",
    "Place",
    "Role",
    "Share",
    "Sortie",
    "SpacingStep",
    "Track",
    "Variogram",
    "VariogramModel",
    "Vehicle",
    "WeightedArea",
]

FloatArray = npt.NDArray[np.float64]
Place = tuple[float, float]
"""A planar position (x east, y north) in metres."""

Q = TypeVar("Q", bound="Message")
R = TypeVar("R", bound="Message")


class Message(msgspec.Struct, frozen=True, kw_only=True):
    """Base of every message on the bus between Oxbow's own processes."""


def require_finite(message: Message, *fields: str, least: float = -math.inf, above: float = -math.inf) -> None:
    """Check numeric fields of a message: finite, at least `least`, strictly above `above`."""
    for field in fields:
        value = getattr(message, field)
        if value is not None and not (math.isfinite(value) and value >= least and value > above):
            accepted = f"> {above}" if above > -math.inf else f">= {least}" if least > -math.inf else "any"
            raise InvalidMission(f"is {value!r}; expected a finite number, {accepted}", where=field)


def require_area(message: Message, *fields: str) -> None:
    """Check polygon fields of a message: valid, with an area."""
    for field in fields:
        polygon = getattr(message, field)
        if polygon.is_empty or not polygon.is_valid:
            raise InvalidMission("is empty or not a valid polygon", where=field)


class Method(enum.StrEnum):
    """A way to generate a path; the names are the report's (Rendas and Li 2016, section 1.1)."""

    SPACE_FILLING_CURVE = "SpaceFillingCurve"
    TOUR = "Tour"
    TRANSECT = "Transect"
    WATERSHED = "Watershed"


class Draw(enum.StrEnum):
    """How the inputs of the space-filling curve's network are drawn (Rendas and Li 2016, section 1.2.1.4)."""

    LOW_DISCREPANCY = "low-discrepancy"
    CONVEX_COMBINATION = "convex-combination"


# --------------------------------------------------------------------------- contour


class DroppedPart(Message, frozen=True, kw_only=True):
    """Water that a stage leaves out, and why."""

    area_m2: float
    reason: str
    place: Place
    outline: Polygon


class ContourRequest(Message, frozen=True, kw_only=True):
    """The site as the mission describes it: the valid outline (no holes) and the forbidden zones.

    `spacing_m` is the nominal spacing of transects, area / length: the scale of detail that matters.
    `tolerance_m` is the half width of the strip a simplified edge may stand for; by default it is
    derived from `safety_m` and `spacing_m`.
    """

    outline: Polygon
    zones: tuple[Polygon, ...] = ()
    safety_m: float = 0.0
    spacing_m: float
    tolerance_m: float | None = None

    def __post_init__(self) -> None:
        require_area(self, "outline")
        require_finite(self, "safety_m", "tolerance_m", least=0.0)
        require_finite(self, "spacing_m", above=0.0)


class FreeSpace(Message, frozen=True, kw_only=True):
    """Where a vehicle may go.

    `free` is one polygon (islands are holes), valid, and inside the true outline eroded by the safety
    distance. `water` is the true water, not eroded, that launch and recovery legs may cross.
    """

    free: Polygon
    water: Polygon
    tolerance_m: float
    compression: float
    dropped: tuple[DroppedPart, ...] = ()
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_area(self, "free")


# --------------------------------------------------------------------------- decomposition


class CriticalKind(enum.StrEnum):
    """What happens to the sweep line's cells at a critical point."""

    OPEN = "open"
    CLOSE = "close"
    SPLIT = "split"
    MERGE = "merge"


class CriticalPoint(Message, frozen=True, kw_only=True):
    """A vertex at which the number of cells on the sweep line changes; `place` is planar."""

    kind: CriticalKind
    place: Place


class Cell(Message, frozen=True, kw_only=True):
    """A region between a floor and a ceiling, met by every transect line in one interval.

    `floor` and `ceiling` are float arrays of shape (n, 2) in the *sweep frame* of the decomposition
    (u across the transects, v along them), both with non-decreasing u, and with equal first and equal
    last u. `start` and `end` are indices of the critical points at which the cell begins and ends.
    """

    floor: FloatArray
    ceiling: FloatArray
    start: int
    end: int

    def __post_init__(self) -> None:
        for field in ("floor", "ceiling"):
            chain = getattr(self, field)
            if chain.ndim != 2 or chain.shape[1] != 2 or len(chain) < 1 or (np.diff(chain[:, 0]) < 0).any():
                raise InvalidMission("is not an (n, 2) chain with non-decreasing u", where=field)


class HeadingScore(Message, frozen=True, kw_only=True):
    """The predicted cost of one heading: metres of path per square metre of water, less is better."""

    heading_rad: float
    predicted_cost: float


class DecomposeRequest(Message, frozen=True, kw_only=True):
    """Free space to cut into cells; the best of several headings where `heading_rad` is absent."""

    free: Polygon
    spacing_m: float
    heading_rad: float | None = None

    def __post_init__(self) -> None:
        require_area(self, "free")
        require_finite(self, "spacing_m", above=0.0)
        require_finite(self, "heading_rad")


class Decomposition(Message, frozen=True, kw_only=True):
    """Cells that tile the free space, and the critical points between them: the Reeb graph.

    Transects run along `heading_rad` (clockwise from north). Sweep frame and planar frame differ by a
    rotation: u = x cos h - y sin h, v = x sin h + y cos h. The Reeb graph's nodes are the critical points,
    its edges the cells (`start` -> `end`).
    """

    heading_rad: float
    cells: tuple[Cell, ...]
    critical_points: tuple[CriticalPoint, ...]
    scores: tuple[HeadingScore, ...] = ()


# --------------------------------------------------------------------------- path


class WeightedArea(Message, frozen=True, kw_only=True):
    """Where sampling is `weight` times as important as elsewhere, where the weight is 1."""

    area: Polygon
    weight: float

    def __post_init__(self) -> None:
        require_area(self, "area")
        require_finite(self, "weight", least=0.0)


class PathRequest(Message, frozen=True, kw_only=True):
    """What a path must keep to: the water, its cells, the longest length, the least spacing.

    `weighted_areas` do not overlap, and may reach beyond the water. `time_limit_s` is what may be spent on
    improving the path; without it the work is fixed, and the same request gives the same path everywhere.
    `smooth` asks for rounded corners. `draw` matters to the space-filling curve alone.
    """

    method: Method = Method.SPACE_FILLING_CURVE
    space: FreeSpace
    decomposition: Decomposition
    launch: Place
    recovery: Place
    length_m: float
    min_spacing_m: float = 0.0
    seed: int = 0
    weighted_areas: tuple[WeightedArea, ...] = ()
    time_limit_s: float | None = None
    smooth: bool = False
    draw: Draw = Draw.LOW_DISCREPANCY

    def __post_init__(self) -> None:
        require_finite(self, "length_m", "time_limit_s", above=0.0)
        require_finite(self, "min_spacing_m", least=0.0)


class SpacingStep(Message, frozen=True, kw_only=True):
    """One turn of the spacing loop (report, steps 5 to 8): the spacing tried and the length it gave."""

    spacing_m: float
    length_m: float


class PathPlan(Message, frozen=True, kw_only=True):
    """A path from launch to recovery, simple and inside the free space (legs in the water)."""

    path: LineString
    spacing_m: float
    steps: tuple[SpacingStep, ...]
    dropped: tuple[DroppedPart, ...] = ()
    warnings: tuple[str, ...] = ()


# --------------------------------------------------------------------------- assignment


class Role(enum.StrEnum):
    """What a vehicle is for: a master surveys, a slave treats (Rendas and Li 2016, section 1.1)."""

    MASTER = "master"
    SLAVE = "slave"


class Vehicle(Message, frozen=True, kw_only=True):
    """One vehicle of the fleet.

    Parameters
    ----------
    name
        What the mission calls it.
    role
        What it is for.
    speed_mps
        Its speed along a route.
    length_m
        The longest route that it may travel, from start to recovery: its range.
    start, recovery
        Where it is now and where it ends.

    Raises
    ------
    InvalidMission
        A vehicle without a name, a speed, a range or a place; the error names the vehicle.
    """

    name: str
    role: Role = Role.SLAVE
    speed_mps: float = 1.0
    length_m: float
    start: Place
    recovery: Place

    def __post_init__(self) -> None:
        if not self.name:
            raise InvalidMission("is empty; expected a name for every vehicle", where="name")
        for field, unit in (("speed_mps", "m/s"), ("length_m", "m")):
            value = getattr(self, field)
            if not (math.isfinite(value) and value > 0.0):
                raise InvalidMission(
                    f"is {value!r} {unit}; expected a finite number > 0", where=f"vehicle {self.name!r}: {field}"
                )
        for field in ("start", "recovery"):
            if not all(map(math.isfinite, getattr(self, field))):
                raise InvalidMission(
                    f"is {getattr(self, field)!r}; expected two finite numbers",
                    where=f"vehicle {self.name!r}: {field}",
                )


class HotSpot(Message, frozen=True, kw_only=True):
    """Water to treat: a part of the site whose value is at or above the threshold."""

    name: str
    area: Polygon
    value: float

    def __post_init__(self) -> None:
        require_area(self, "area")
        require_finite(self, "value")


class AssignRequest(Message, frozen=True, kw_only=True):
    """Who does what: water to share among the masters, and hot spots to treat by the slaves.

    Parameters
    ----------
    free
        Where vehicles may go.
    vehicles
        The fleet.
    share_free
        Whether the free space is to be shared among the masters, in proportion to length times speed.
    footprint_m
        Edge of the triangles that shares are made of; chosen by the stage where it is absent.
    hot_spots
        What the slaves treat.
    swath_m
        The width that one pass over a hot spot treats.
    seed
        Where clustering starts.
    """

    free: Polygon
    vehicles: tuple[Vehicle, ...]
    share_free: bool = False
    footprint_m: float | None = None
    hot_spots: tuple[HotSpot, ...] = ()
    swath_m: float | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        require_area(self, "free")
        require_finite(self, "footprint_m", "swath_m", above=0.0)
        if not self.vehicles:
            raise InvalidMission("is empty; expected one vehicle or more", where="vehicles")
        names = [vehicle.name for vehicle in self.vehicles]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise InvalidMission(f"has {twice!r} twice; expected a name of its own for each", where="vehicles")
        if self.hot_spots and self.swath_m is None:
            raise InvalidMission("is missing; hot spots are treated in passes of that width", where="swath_m")


class Share(Message, frozen=True, kw_only=True):
    """The connected part of the free space that one master surveys."""

    vehicle: str
    area: Polygon


class Sortie(Message, frozen=True, kw_only=True):
    """One journey of a slave: from its start over hot spots, named in order, to its recovery."""

    vehicle: str
    path: LineString
    hot_spots: tuple[str, ...]
    length_m: float
    duration_s: float


class LeftSpot(Message, frozen=True, kw_only=True):
    """A hot spot that no vehicle can treat within its range, and why; the best value for its way comes first."""

    hot_spot: str
    value_per_m: float
    reason: str


class Assignment(Message, frozen=True, kw_only=True):
    """Who does what.

    Parameters
    ----------
    shares
        One a master, where the free space was to be shared. Together they are the free space.
    imbalance
        The largest deviation of a share's area from what its vehicle's capacity asks for, as a part of that.
    sorties
        The first journey of every slave that has one, within its range.
    further
        Journeys proposed for what these leave: from the start once more.
    left
        What no journey of its own could treat.
    treated_share
        Of each hot spot's area in the free space, how much the sorties' swaths cover, in order of the request.
    makespan_s
        Duration of the longest sortie.
    joint_gap
        How much longer the makespan is than a joint optimiser's, as a part of that; None without the optimiser.
    """

    shares: tuple[Share, ...] = ()
    imbalance: float = 0.0
    sorties: tuple[Sortie, ...] = ()
    further: tuple[Sortie, ...] = ()
    left: tuple[LeftSpot, ...] = ()
    treated_share: tuple[float, ...] = ()
    makespan_s: float = 0.0
    joint_gap: float | None = None
    warnings: tuple[str, ...] = ()


# --------------------------------------------------------------------------- certificate


class VariogramModel(enum.StrEnum):
    """How the values of a field at two places differ, by their distance."""

    EXPONENTIAL = "exponential"
    SPHERICAL = "spherical"
    GAUSSIAN = "gaussian"
    MATERN32 = "matern32"


class Variogram(Message, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A stationary and isotropic model of a field: half the mean squared difference of two places' values.

    It rises from `nugget`, by which places right beside one another differ, to `sill`, by which places far apart
    do (the nugget included); both are in the squared unit of the field. Within `range_m`, 95 % of that rise is
    done, in the spherical model all of it. `matern32` is Matern's model of smoothness 3/2.
    """

    model: VariogramModel
    range_m: float
    sill: float
    nugget: float = 0.0

    def __post_init__(self) -> None:
        require_finite(self, "range_m", "sill", above=0.0)
        require_finite(self, "nugget", least=0.0)
        if self.nugget >= self.sill:
            raise InvalidMission(f"is {self.nugget!r}; expected less than the sill, {self.sill!r}", where="nugget")


class Track(Message, frozen=True, kw_only=True):
    """One vehicle's path, where it should start and end, and how fast it is travelled."""

    path: LineString
    launch: Place
    recovery: Place
    speed_mps: float = 1.0

    def __post_init__(self) -> None:
        require_finite(self, "speed_mps", above=0.0)
        if not (0 < self.path.length < math.inf):
            raise InvalidMission(
                f"is {self.path.length!r} m long; expected a path of finite length > 0", where="path"
            )


class CertifyRequest(Track, frozen=True, kw_only=True):
    """A path to judge against the mission itself: the true outline and zones, not the planner's free space.

    The paths of a team are judged together: `others` are those of its further vehicles. `areas` are what the paths
    are to cover where that is not all of the free space: the hot spots of a treatment.
    """

    outline: Polygon
    zones: tuple[Polygon, ...] = ()
    safety_m: float = 0.0
    variogram: Variogram | None = None
    others: tuple[Track, ...] = ()
    areas: tuple[Polygon, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        require_area(self, "outline")
        require_finite(self, "safety_m", least=0.0)

    @property
    def tracks(self) -> tuple[Track, ...]:
        """Every path."""
        return (self, *self.others)


class Conformance(Message, frozen=True, kw_only=True):
    """What there is of a path, and whether it keeps the rules; defined in `docs/quality.md`."""

    length_m: float
    duration_s: float
    waypoints: int
    is_simple: bool
    crossings: int
    outside_m: float
    unsafe_m: float


class Measures(Conformance, frozen=True, kw_only=True):
    """How good a path is against what is possible; the measures are defined in `docs/quality.md`.

    Of several paths, `duration_s` is that of the longest, figures of the rules are sums, and coverage is that of
    all of them together.

    `cover_radius_m` are certified (low, high) bounds of the largest distance from a point of the free space to
    the path (report, section 1.2.1, MinMax); `least_radius_m` is the least any path of that length could reach.
    The kriging variances, shares of the sill, are there where a variogram is. `least_leg_distance_m` (MaxMin) is
    None where no two legs are parallel, the discrepancy where the path keeps outside the free space; and all that
    may be None is so in plans of earlier versions.
    """

    components: int
    free_area_m2: float
    judged_area: float
    cover_radius_m: tuple[float, float]
    least_radius_m: float
    q: float
    mean_distance_m: float
    p95_distance_m: float
    mean_ratio: float
    p95_ratio: float
    p99_distance_m: float | None = None
    p99_ratio: float | None = None
    least_leg_distance_m: float | None = None
    discrepancy: float | None = None
    discrepancy_ratio: float | None = None
    directional_evenness: float | None = None
    turns: int | None = None
    kriging_variance_mean: float | None = None
    kriging_variance_max: float | None = None


class Certificate(Measures, frozen=True, kw_only=True):
    """The measures of a path, and the place of the free space that is farthest from it.

    `tracks` are the figures of each path, where there are several.
    """

    worst_gap: Place | None = None
    tracks: tuple[Conformance, ...] = ()


# --------------------------------------------------------------------------- DSS and guidance, in JSON

DEFAULT_DEADLINE_S = 120.0
"""Seconds that planning one mission may take, its wait for a free planner not counted."""


class MissionState(enum.StrEnum):
    """How far a mission's revision has come; `DONE` and `FAILED` are final."""

    ACCEPTED = "accepted"
    PLANNING = "planning"
    DONE = "done"
    FAILED = "failed"

    @property
    def is_final(self) -> bool:
        return self in (MissionState.DONE, MissionState.FAILED)


class MissionStatus(Message, frozen=True, kw_only=True):
    """Where a mission stands.

    Parameters
    ----------
    mission_id, revision
        Which request it is about: every new content under one id is a new revision, counted from 1. A request
        whose id cannot be kept has revision 0.
    state
        Accepted requests are on disk: each of them ends `done` or `failed`, whatever crashes.
    stage
        The stage at work while `planning`.
    fraction
        The share of the stages that are done, 0 to 1.
    error
        Why it `failed`.
    time_s
        Unix time of this state.
    """

    mission_id: str
    revision: int
    state: MissionState
    stage: str = ""
    fraction: float = 0.0
    error: ErrorReply | None = None
    time_s: float


# --------------------------------------------------------------------------- endpoints and keys

PREFIX = "oxbow/v1"
MAX_REQUEST_BYTES = 128 * 2**20
_ID = re.compile(r"[A-Za-z0-9_.-]+")


def checked_id(text: str, where: str = "id") -> str:
    """`text`, if it may stand as one chunk of a key expression."""
    if not _ID.fullmatch(text):
        raise InvalidMission(f"is {text!r}; expected one or more of A-Z a-z 0-9 _ . -", where=where)
    return text


@dataclass(frozen=True)
class Endpoint(Generic[Q, R]):
    """One request/reply exchange that a stage serves."""

    stage: str
    request: type[Q]
    reply: type[R]

    def instance_key(self, instance: str) -> str:
        """Where one replica of the stage takes queries."""
        return f"{PREFIX}/stage/{self.stage}/{checked_id(instance)}"

    def introspection_key(self, instance: str, what: str) -> str:
        """Where one replica tells about itself; `what` is one of `INTROSPECTION`."""
        return introspection_key(self.stage, instance, what)

    def live_key(self, instance: str) -> str:
        """The liveliness token of one replica."""
        return live_key(self.stage, instance)


CONTOUR: Endpoint[ContourRequest, FreeSpace] = Endpoint("contour", ContourRequest, FreeSpace)
DECOMPOSE: Endpoint[DecomposeRequest, Decomposition] = Endpoint("decomposition", DecomposeRequest, Decomposition)
PATH: Endpoint[PathRequest, PathPlan] = Endpoint("path", PathRequest, PathPlan)
ASSIGN: Endpoint[AssignRequest, Assignment] = Endpoint("assignment", AssignRequest, Assignment)
CERTIFY: Endpoint[CertifyRequest, Certificate] = Endpoint("certificate", CertifyRequest, Certificate)

STAGES: tuple[Endpoint[Any, Any], ...] = (CONTOUR, ASSIGN, DECOMPOSE, PATH, CERTIFY)


INTROSPECTION = ("ping", "info", "stats", "schema")
ANY_LIVE = f"{PREFIX}/live/*/*"


def live_key(service: str, instance: str) -> str:
    """The liveliness token of one process of a service; stages and other services alike."""
    return f"{PREFIX}/live/{checked_id(service)}/{checked_id(instance)}"


def live_service(key: str) -> tuple[str, str]:
    """The service and the instance of a liveliness token's key."""
    service, instance = key.removeprefix(f"{PREFIX}/live/").split("/")
    return service, instance


def introspection_key(service: str, instance: str, what: str) -> str:
    """Where a process of a service tells about itself; `what` is one of `INTROSPECTION`."""
    return f"{PREFIX}/stage/{checked_id(service)}/{checked_id(instance)}/@{what}"


def any_introspection_key(what: str) -> str:
    """Asks every replica of every stage; `what` is one of `INTROSPECTION`."""
    return f"{PREFIX}/stage/*/*/@{what}"


ANY = "*"
"""In place of one chunk of a key, matches all."""


@dataclass(frozen=True)
class MissionKey:
    """``oxbow/v1/mission/{id}/{what}``, or ``.../{what}/{revision}`` for the history of plans and replans.

    Parameters
    ----------
    mission_id
        One mission, or `ANY`.
    what
        ``request``, ``status``, ``plan``, ``report`` or ``replan``.
    revision
        One revision, `ANY`, or None for the latest.
    """

    mission_id: str
    what: str
    revision: int | str | None = None

    def __str__(self) -> str:
        key = f"{PREFIX}/mission/{self.mission_id}/{self.what}"
        return key if self.revision is None else f"{key}/{self.revision}"

    @classmethod
    def parse(cls, key: str) -> MissionKey:
        """Take a key apart; the id is as it came, fit for a reply or not."""
        match = _MISSION_KEY.fullmatch(key)
        if match is None:
            expected = f"{PREFIX}/mission/{{id}}/{{what}}[/{{revision}}], each one name, number or {ANY}"
            raise InvalidMission(f"is {key!r}; expected {expected}", where="key")
        mission_id, what, revision = match.groups()
        return cls(mission_id, what, int(revision) if revision and revision != ANY else revision)


_MISSION_KEY = re.compile(rf"{PREFIX}/mission/([^/]+)/([a-z]+)(?:/([0-9]{{1,9}}|\*))?")


def mission_key(mission_id: str, what: str) -> str:
    """The key of one mission; ``oxbow/v1/mission/{id}/{what}``."""
    return str(MissionKey(checked_id(mission_id), what))


PLAN_KEY = f"{PREFIX}/plan"


def layer_key(mission_id: str, stage: str, name: str) -> str:
    """Where a stage's layer of one mission is put."""
    return f"{PREFIX}/layer/{checked_id(mission_id)}/{checked_id(stage)}/{checked_id(name)}"


ANY_LAYER = f"{PREFIX}/layer/*/*/*"


def any_layer_key(stage: str) -> str:
    """Every layer that a stage shows, of any mission."""
    return f"{PREFIX}/layer/*/{checked_id(stage)}/*"
