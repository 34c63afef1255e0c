"""Stage `assignment`: who surveys and treats what."""

from __future__ import annotations

import enum
import math

from msgspec import field
from shapely import LineString, Polygon

from oxbow.arrays import Place
from oxbow.contracts.approach import Approach
from oxbow.contracts.contour import DroppedPart
from oxbow.contracts.danger import DANGER_DETOUR_M, DangerZone
from oxbow.contracts.message import (
    MOST_LENGTH_M,
    MOST_SEED,
    Message,
    require_area,
    require_finite,
    require_line,
    require_place,
)
from oxbow.contracts.route import RouteMethod
from oxbow.errors import InvalidRequest, renamed
from oxbow.ids import MOST_ID_CHARACTERS, excerpt
from oxbow.tolerances import FARTHEST_M

__all__ = ["AssignRequest", "Assignment", "HotSpot", "LeftSpot", "Role", "Share", "Sortie", "Vehicle"]


class Role(enum.StrEnum):
    """What a vehicle is for: a master surveys, a slave treats (Rendas and Li 2016, section 1.1)."""

    MASTER = "master"
    SLAVE = "slave"


class Vehicle(Message, frozen=True, kw_only=True):
    """One vehicle of the fleet.

    Parameters
    ----------
    name
        Its name in the mission.
    role
        Whether it surveys or treats.
    speed_mps
        Its speed along a route.
    length_m
        The longest route that it may travel, from start to recovery: its range.
    start, recovery
        Where it is now and where it ends.
    danger_factor
        How many times as much danger counts for it, at least 1; the factor `a` of Innocenti, Pollini and Bracci
        2006, section 3.
    danger_factors
        The same on the way to and from particular hot spots, by name: the report sets it per vehicle and target.

    Raises
    ------
    InvalidRequest
        A vehicle without a name, a speed, a range or a place, or a factor below 1; the error names the vehicle.
    """

    name: str
    role: Role = Role.SLAVE
    speed_mps: float = 1.0
    length_m: float
    start: Place
    recovery: Place
    danger_factor: float = 1.0
    danger_factors: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.name:
            raise InvalidRequest("is empty; expected a name for every vehicle", where="name")
        # Before the name is quoted below in the errors of other fields.
        if len(self.name) > MOST_ID_CHARACTERS:
            raise InvalidRequest(
                f"is {excerpt(self.name)}; expected at most {MOST_ID_CHARACTERS} characters", where="name"
            )
        with renamed({name: self.field(name) for name in self.__struct_fields__}):
            require_finite(self, "speed_mps", "length_m", above=0.0, most=MOST_LENGTH_M)
            require_finite(self, "danger_factor", least=1.0)
            require_place(self, "start", "recovery")
        for spot, factor in self.danger_factors.items():
            if not 1.0 <= factor < math.inf:
                raise InvalidRequest(
                    f"is {factor!r}; expected a finite number >= 1",
                    where=self.field(f"danger_factors[{excerpt(spot)}]"),
                )

    def field(self, name: str) -> str:
        """What errors call one of its fields, where a request has several vehicles."""
        return f"vehicle {self.name!r}: {name}"


class HotSpot(Message, frozen=True, kw_only=True):
    """Water to treat: a part of the site whose value is at or above the threshold."""

    name: str
    area: Polygon
    value: float

    def __post_init__(self) -> None:
        require_area(self, "area")
        require_finite(self, "value")


class AssignRequest(Message, frozen=True, kw_only=True):
    """A division of work to make: water to share among the masters, and hot spots for the slaves to treat.

    Parameters
    ----------
    free
        Where vehicles may go.
    water
        What legs to and from the free space may cross; without it they are straight.
    vehicles
        The fleet.
    share_free
        Whether the free space is to be shared among the masters, in proportion to the range that their ways leave.
    spacing_m
        The nominal spacing of the surveys, in proportion to which legs to shares keep apart; by default, what the
        masters' ranges allow.
    footprint_m
        The longest edge of the triangles that shares are made of; by default, the stage chooses it.
    hot_spots
        What the slaves treat.
    swath_m
        The width that one pass over a hot spot treats.
    danger_zones
        What the slaves' routes avoid, as far as the detour is worth it.
    danger_detour_m
        The detour that raising the chance of no harm by a factor of e is worth.
    router
        How the slaves' routes to, between and from hot spots are found.
    seed
        Seed of the random start of clustering.
    """

    free: Polygon
    water: Polygon | None = None
    vehicles: tuple[Vehicle, ...]
    share_free: bool = False
    spacing_m: float | None = None
    footprint_m: float | None = None
    hot_spots: tuple[HotSpot, ...] = ()
    swath_m: float | None = None
    danger_zones: tuple[DangerZone, ...] = ()
    danger_detour_m: float = DANGER_DETOUR_M
    router: RouteMethod = RouteMethod.VISIBILITY
    seed: int = 0

    def __post_init__(self) -> None:
        require_area(self, "free", "water")
        require_finite(self, "spacing_m", "footprint_m", "swath_m", above=0.0, most=FARTHEST_M)
        require_finite(self, "danger_detour_m", least=0.0, most=MOST_LENGTH_M)
        require_finite(self, "seed", least=0, most=MOST_SEED)
        if not self.vehicles:
            raise InvalidRequest("is empty; expected one vehicle or more", where="vehicles")
        names = [vehicle.name for vehicle in self.vehicles]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise InvalidRequest(f"has {twice!r} twice; expected a different name for each", where="vehicles")
        if self.hot_spots and self.swath_m is None:
            raise InvalidRequest("is missing; hot spots are treated in passes of that width", where="swath_m")


class Share(Message, frozen=True, kw_only=True):
    """The connected part of the free space that one master surveys, and how it gets there and home."""

    vehicle: str
    area: Polygon
    approach: Approach

    def __post_init__(self) -> None:
        require_area(self, "area")


class Sortie(Message, frozen=True, kw_only=True):
    """One journey of a slave: from its start over hot spots, listed in order, to its recovery."""

    vehicle: str
    path: LineString
    hot_spots: tuple[str, ...]
    length_m: float
    duration_s: float

    def __post_init__(self) -> None:
        require_line(self, "path")
        require_finite(self, "length_m", "duration_s", least=0.0)


class LeftSpot(Message, frozen=True, kw_only=True):
    """A hot spot that no vehicle can treat within its range, and why; the best value for its way comes first."""

    hot_spot: str
    value_per_m: float
    reason: str

    def __post_init__(self) -> None:
        require_finite(self, "value_per_m")


class Assignment(Message, frozen=True, kw_only=True):
    """The division of work among the vehicles.

    Parameters
    ----------
    shares
        One per master, if the free space was to be shared. Together with what is dropped they make up the free
        space.
    imbalance
        The largest relative deviation of a share's area from its due. The area due to a vehicle is in proportion
        to the range that remains after the way to its share and home.
    dropped
        Water that no master can survey and still be home within its range.
    sorties
        The first journey of every slave that has one, within its range.
    further
        Journeys proposed for what the sorties leave, again from the start.
    left
        Hot spots that not even a journey of their own could treat.
    treated_share
        Of each hot spot's area in the free space, how much the sorties' swaths cover, in order of the request.
    makespan_s
        Duration of the longest sortie.
    joint_gap
        How much more the sorties cost than those of a joint optimiser, relative to the latter: 0 where the
        optimiser's are the best, and are taken. None without the optimiser, and where it serves fewer.
    """

    shares: tuple[Share, ...] = ()
    imbalance: float = 0.0
    dropped: tuple[DroppedPart, ...] = ()
    sorties: tuple[Sortie, ...] = ()
    further: tuple[Sortie, ...] = ()
    left: tuple[LeftSpot, ...] = ()
    treated_share: tuple[float, ...] = ()
    makespan_s: float = 0.0
    joint_gap: float | None = None
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_finite(self, "imbalance", "makespan_s", least=0.0)
        require_finite(self, "joint_gap")
        if not all(0.0 <= share < math.inf for share in self.treated_share):
            raise InvalidRequest(f"is {self.treated_share!r}; expected numbers from 0", where="treated_share")
