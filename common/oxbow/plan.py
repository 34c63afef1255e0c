"""What a plan is asked for and what is recorded of it: the options, and the `Plan` object of a Mission File."""

from __future__ import annotations

from oxbow.contracts import Draw, Measures, Message, Method, require_finite
from oxbow.frame import Position

__all__ = ["DroppedWater", "PlanCertificate", "PlanOptions", "PlanRecord"]


class PlanOptions(Message, frozen=True, kw_only=True):
    """How to plan, beside what the Mission File says; a heading or tolerance left out is chosen by the planner.

    `time_limit_s` is how long the path method may spend on improving the path. By default it does a fixed amount
    of work, so that the same request gives the same plan on every machine; with a limit it stops earlier, and
    the plan depends on the machine. `smooth` asks for rounded corners; `draw` matters to the space-filling curve.
    """

    method: Method = Method.SPACE_FILLING_CURVE
    seed: int = 0
    heading_rad: float | None = None
    tolerance_m: float | None = None
    time_limit_s: float | None = None
    smooth: bool = False
    draw: Draw = Draw.LOW_DISCREPANCY

    def __post_init__(self) -> None:
        require_finite(self, "heading_rad")
        require_finite(self, "time_limit_s", above=0.0)
        require_finite(self, "seed", "tolerance_m", least=0.0)


class PlanCertificate(Measures, frozen=True, kw_only=True):
    """The certificate as the Mission File keeps it: the worst gap in degrees."""

    worst_gap: Position | None = None


class DroppedWater(Message, frozen=True, kw_only=True):
    """Water that the plan leaves out, why, and a place in it."""

    area_m2: float
    reason: str
    place: Position


class PlanRecord(Message, frozen=True, kw_only=True):
    """The `Plan` object of a completed Mission File: how the path was made and how good it is.

    Transects run along `heading_deg` (clockwise from north). `length_m` is the geodesic length of the
    waypoints as written. The same mission, options and versions give the same plan, unless there was a
    `time_limit_s`. `mission_id` and `revision` are those that the mission service keeps the plan under; they are
    None in a plan made without it.
    """

    method: Method
    seed: int
    time_limit_s: float | None = None
    heading_deg: float
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
    mission_id: str | None = None
    revision: int | None = None
