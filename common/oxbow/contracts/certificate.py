"""Stage `certificate`: from paths to how good they are."""

from __future__ import annotations

import enum
import math

from shapely import LineString, Polygon

from oxbow.arrays import Place
from oxbow.contracts.danger import DangerZone
from oxbow.contracts.message import Message, require_area, require_finite, require_line, require_place
from oxbow.errors import InvalidRequest
from oxbow.tolerances import FARTHEST_M

__all__ = [
    "Certificate",
    "CertifyRequest",
    "Conformance",
    "Fault",
    "Leg",
    "Measures",
    "Rule",
    "Track",
    "Variogram",
    "VariogramModel",
]


class VariogramModel(enum.StrEnum):
    """How the difference of a field's values at two places depends on their distance."""

    EXPONENTIAL = "exponential"
    SPHERICAL = "spherical"
    GAUSSIAN = "gaussian"
    MATERN32 = "matern32"


class Variogram(Message, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A stationary and isotropic model of a field: half the mean squared difference of two places' values.

    It rises from `nugget`, for places right beside one another, to `sill`, for places far apart (the nugget
    included); both are in the squared unit of the field. Within `range_m` it has made 95 % of that rise, in the
    spherical model all of it. `matern32` is Matern's model of smoothness 3/2.
    """

    model: VariogramModel
    range_m: float
    sill: float
    nugget: float = 0.0

    def __post_init__(self) -> None:
        require_finite(self, "range_m", "sill", above=0.0)
        require_finite(self, "nugget", least=0.0)
        if self.nugget >= self.sill:
            raise InvalidRequest(f"is {self.nugget!r}; expected less than the sill, {self.sill!r}", where="nugget")


class Track(Message, frozen=True, kw_only=True):
    """One vehicle's path, where it should start and end, and how fast it is travelled."""

    path: LineString
    launch: Place
    recovery: Place
    speed_mps: float = 1.0

    def __post_init__(self) -> None:
        require_finite(self, "speed_mps", above=0.0)
        require_place(self, "launch", "recovery")
        require_line(self, "path")
        if not (0 < self.path.length < math.inf):
            raise InvalidRequest(
                f"is {self.path.length!r} m long; expected a path of finite length > 0", where="path"
            )


class CertifyRequest(Track, frozen=True, kw_only=True):
    """A path to judge against the mission itself: the true outline and zones, not the planner's free space.

    The paths of a team are judged together: `others` are those of its further vehicles. `areas` are what the paths
    are to cover if that is not all of the free space: the hot spots of a treatment. Water narrower than
    `least_width_m` need not be covered. With `danger_zones`, the probability of harm is reported.
    """

    outline: Polygon
    zones: tuple[Polygon, ...] = ()
    safety_m: float = 0.0
    least_width_m: float = 0.0
    variogram: Variogram | None = None
    others: tuple[Track, ...] = ()
    areas: tuple[Polygon, ...] = ()
    danger_zones: tuple[DangerZone, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        require_area(self, "outline", "zones", "areas")
        require_finite(self, "safety_m", "least_width_m", least=0.0, most=FARTHEST_M)

    @property
    def tracks(self) -> tuple[Track, ...]:
        """Every path."""
        return (self, *self.others)


class Rule(enum.StrEnum):
    """What a path must keep to, apart from what its launch and recovery points make necessary."""

    CROSSING = "crossing"
    OUTSIDE = "outside"
    UNSAFE = "unsafe"


class Fault(Message, frozen=True, kw_only=True):
    """A rule that a path breaks: by how many metres or how many times, and a place where it does.

    `leg` is "launch" or "recovery" where the fault is in that leg, `track` the number of the path.
    """

    rule: Rule
    place: Place
    metres: float = 0.0
    count: int = 0
    leg: str = ""
    track: int = 0

    def __post_init__(self) -> None:
        require_place(self, "place")
        require_finite(self, "metres", "count", "track", least=0.0)


class Leg(Message, frozen=True, kw_only=True):
    """The stretch of a path beside its launch or recovery point that runs within the safety distance.

    `unsafe_m` metres of it do, `ashore_m` of these over land. The position of the point makes
    `least_ashore_m` and about `most_unsafe_m` necessary: the one is its distance from the water, the other the
    most that its way to open water may take.
    """

    unsafe_m: float
    ashore_m: float
    least_ashore_m: float
    most_unsafe_m: float

    def __post_init__(self) -> None:
        require_finite(self, "unsafe_m", "ashore_m", "least_ashore_m", "most_unsafe_m", least=0.0)


class Conformance(Message, frozen=True, kw_only=True):
    """The size of a path, and whether it keeps the rules; defined in `docs/quality.md`.

    `danger` is the probability of harm on the way, None where there are no danger zones. `legs` are those of the
    launch and of the recovery; there are none in plans of earlier versions.
    """

    length_m: float
    duration_s: float
    waypoints: int
    is_simple: bool
    crossings: int
    outside_m: float
    unsafe_m: float
    danger: float | None = None
    legs: tuple[Leg, ...] = ()

    def __post_init__(self) -> None:
        require_finite(self, *(name for name in self.__struct_fields__ if isinstance(getattr(self, name), float)))


class Measures(Conformance, frozen=True, kw_only=True):
    """How good a path is, compared with what is possible; the measures are defined in `docs/quality.md`.

    Of several paths, `duration_s` is that of the longest, figures of the rules are sums, `danger` is the
    probability that any of them comes to harm, and coverage is that of all of them together.

    `cover_radius_m` are certified (low, high) bounds of the largest distance from a point of the free space to
    the path (report, section 1.2.1, MinMax); `least_radius_m` is the least any path of that length could reach.
    The kriging variances, as shares of the sill, are given if there is a variogram. `least_leg_distance_m`
    (MaxMin) is None where no two legs are parallel, the discrepancy where the path stays outside the free space;
    whatever may be None is None in plans of earlier versions.
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

    def __post_init__(self) -> None:
        super().__post_init__()
        low_m, high_m = self.cover_radius_m
        if not 0.0 <= low_m <= high_m < math.inf:
            raise InvalidRequest(f"is {self.cover_radius_m!r}; expected 0 <= low <= high", where="cover_radius_m")


class Certificate(Measures, frozen=True, kw_only=True):
    """The measures of a path, and the place of the free space that is farthest from it.

    `tracks` are the figures of each path, where there are several. `faults` are the rules that paths break.
    `request_digest` is that of the request (`oxbow.wire.codec.digest`), so that a certificate cannot be mistaken
    for that of another path or another water.
    """

    request_digest: str
    worst_gap: Place | None = None
    tracks: tuple[Conformance, ...] = ()
    faults: tuple[Fault, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        require_place(self, "worst_gap")
