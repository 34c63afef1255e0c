"""The certificate of a path: every measure of it, from the mission's own water."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

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
    space = JudgedSpace.of(request)
    distance = PathDistance(request.path)
    cover = cover_radius(space.judged, distance)
    spread = distance_spread(space.judged, distance)
    least_m = least_radius(space.judged.area, request.path.length)
    certificate = Certificate(
        **_conformance(request, space),
        **_coverage(cover, spread, least_m),
        **_evenness(request, space, least_m),
        **_kriging(request, spread, least_m),
    )
    return Judgement(certificate, space, cover, spread)


def _conformance(request: CertifyRequest, space: JudgedSpace) -> dict[str, Any]:
    """What there is of water and path, and whether the path keeps the rules."""
    path, ends = request.path, (request.launch, request.recovery)
    crossings = count_crossings(path)
    return {
        "length_m": path.length,
        "duration_s": path.length / request.speed_mps,
        "waypoints": int(shapely.get_num_coordinates(path)),
        "is_simple": crossings == 0,
        "crossings": crossings,
        "outside_m": outside_length(path, space),
        "unsafe_m": unsafe_length(path, space, request.safety_m, ends),
        "components": len(space.free.geoms),
        "free_area_m2": space.free.area,
        "judged_area": space.judged_area,
    }


def _coverage(cover: CoverRadius, spread: DistanceSpread, least_m: float) -> dict[str, Any]:
    """How far the water is from the path."""
    return {
        "cover_radius_m": (cover.low_m, cover.high_m),
        "least_radius_m": least_m,
        "q": cover.high_m / least_m,
        "mean_distance_m": spread.mean_m,
        "p95_distance_m": spread.p95_m,
        "p99_distance_m": spread.p99_m,
        "mean_ratio": spread.mean_m / (least_m / 2),
        "p95_ratio": spread.p95_m / least_m,
        "p99_ratio": spread.p99_m / least_m,
        "worst_gap": cover.place,
    }


def _evenness(request: CertifyRequest, space: JudgedSpace, least_m: float) -> dict[str, Any]:
    """How evenly the path samples places and directions."""
    path, spacing_m = request.path, 2.0 * least_m
    ends = about_ends(space, (request.launch, request.recovery), max(2.0 * request.safety_m, spacing_m))
    positions = discrepancy(space.judged, path, spacing_m, 2.0 * space.detail_m)
    return {
        "least_leg_distance_m": least_leg_distance(path, spacing_m, ends),
        "discrepancy": positions.value if positions else None,
        "discrepancy_ratio": positions.ratio if positions else None,
        "directional_evenness": directional_evenness(path),
        "turns": count_turns(path, least_m),
    }


def _kriging(request: CertifyRequest, spread: DistanceSpread, least_m: float) -> dict[str, Any]:
    """How well the field could be told from what the path samples, where its variogram is known."""
    if request.variogram is None:
        return {}
    variance = kriging_variance(request.path, spread.places, request.variogram, least_m)
    return {"kriging_variance_mean": variance.mean, "kriging_variance_max": variance.max}
