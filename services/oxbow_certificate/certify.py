"""The certificate of a path: every measure of it, from the mission's own water."""

from __future__ import annotations

from dataclasses import dataclass

import shapely

from oxbow.contracts import Certificate, CertifyRequest
from oxbow_certificate.conformance import about_ends, count_crossings, outside_length, unsafe_length
from oxbow_certificate.cover import CoverRadius, cover_radius, least_radius
from oxbow_certificate.discrepancy import discrepancy
from oxbow_certificate.distance import PathDistance
from oxbow_certificate.headings import count_turns, directional_evenness
from oxbow_certificate.kriging import kriging_variance
from oxbow_certificate.legs import least_leg_distance
from oxbow_certificate.region import JudgedSpace
from oxbow_certificate.spread import DistanceSpread, distance_spread

__all__ = ["Judgement", "certify", "judge"]


@dataclass(frozen=True)
class Judgement:
    """A certificate and what it was computed from."""

    certificate: Certificate
    space: JudgedSpace
    cover: CoverRadius
    spread: DistanceSpread


def certify(request: CertifyRequest) -> Certificate:
    """The certificate of a path; see `judge`."""
    return judge(request).certificate


def judge(request: CertifyRequest) -> Judgement:
    """Measure a path against its mission and against the best that its length allows.

    A bad path is reported, not refused. A path that enters no part of the free space is judged
    on all of it, with a `judged_area` of 0, so that every figure is finite.

    Raises
    ------
    Infeasible
        The zones or the safety distance leave no water to judge on.
    """
    path = request.path
    space = JudgedSpace.of(request)
    distance = PathDistance(path)
    cover = cover_radius(space.judged, distance)
    spread = distance_spread(space.judged, distance)
    least_m = least_radius(space.judged.area, path.length)
    spacing_m = 2.0 * least_m
    ends = (request.launch, request.recovery)
    crossings = count_crossings(path)
    positions = discrepancy(space.judged, path, spacing_m, 2.0 * space.detail_m)
    meeting_legs = about_ends(space, ends, max(2.0 * request.safety_m, spacing_m))
    variogram = request.variogram
    kriging = kriging_variance(path, spread.places, variogram, least_m) if variogram else None
    certificate = Certificate(
        length_m=path.length,
        duration_s=path.length / request.speed_mps,
        waypoints=int(shapely.get_num_coordinates(path)),
        is_simple=crossings == 0,
        crossings=crossings,
        outside_m=outside_length(path, space),
        unsafe_m=unsafe_length(path, space, request.safety_m, ends),
        components=len(space.free.geoms),
        free_area_m2=space.free.area,
        judged_area=space.judged_area,
        cover_radius_m=(cover.low_m, cover.high_m),
        least_radius_m=least_m,
        q=cover.high_m / least_m,
        mean_distance_m=spread.mean_m,
        p95_distance_m=spread.p95_m,
        mean_ratio=spread.mean_m / (least_m / 2),
        p95_ratio=spread.p95_m / least_m,
        p99_distance_m=spread.p99_m,
        p99_ratio=spread.p99_m / least_m,
        least_leg_distance_m=least_leg_distance(path, spacing_m, meeting_legs),
        discrepancy=positions.value if positions else None,
        discrepancy_ratio=positions.ratio if positions else None,
        directional_evenness=directional_evenness(path),
        turns=count_turns(path, least_m),
        kriging_variance_mean=kriging.mean if kriging else None,
        kriging_variance_max=kriging.max if kriging else None,
        worst_gap=cover.place,
    )
    return Judgement(certificate, space, cover, spread)
