"""The certificate of one or several paths: all their measures, taken on the mission's own water."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import shapely
from shapely import MultiLineString

from oxbow.contracts import Certificate, CertifyRequest, Conformance, Track
from oxbow.geometry.conformance import Conduct, Shore
from oxbow.geometry.route import Danger
from oxbow.wire import codec
from oxbow_certificate.axes import Paths
from oxbow_certificate.cover import CoverRadius, cover_radius, least_radius
from oxbow_certificate.discrepancy import discrepancy
from oxbow_certificate.distance import PathDistance
from oxbow_certificate.headings import count_turns, directional_evenness
from oxbow_certificate.kriging import kriging_variance
from oxbow_certificate.legs import about_ends, least_leg_distance
from oxbow_certificate.region import JudgedSpace
from oxbow_certificate.spread import DistanceSpread, distance_spread

__all__ = ["Judgement", "certify", "judge"]


@dataclass(frozen=True)
class Judgement:
    """A certificate and what it was computed from."""

    certificate: Certificate
    paths: Paths
    space: JudgedSpace
    cover: CoverRadius
    spread: DistanceSpread


def certify(request: CertifyRequest) -> Certificate:
    """The certificate of a path, or of several; see `judge`.

    Examples
    --------
    One straight leg through the middle of a square: nothing is farther from it than the shore.

    >>> from shapely import LineString, box
    >>> leg = LineString([(0, 50), (100, 50)])
    >>> request = CertifyRequest(outline=box(0, 0, 100, 100), path=leg, launch=(0, 50), recovery=(100, 50))
    >>> certificate = certify(request)
    >>> certificate.crossings, certificate.outside_m, certificate.cover_radius_m[0]
    (0, 0.0, 50.0)
    """
    return judge(request).certificate


def judge(request: CertifyRequest) -> Judgement:
    """Measure paths against their mission and against the best that their length allows.

    A bad path is reported, not refused. Paths that enter no part of the free space are judged on all of it, with a
    `judged_area` of 0, so that every figure is finite. Coverage is that of all paths together; the rules apply to
    each path.

    Raises
    ------
    Infeasible
        The zones or the safety distance leave no water to judge on.
    """
    # 1. How far the water is from all paths together, and how far it would be at best.
    space = JudgedSpace.of(request)
    lines = [track.path for track in request.tracks]
    paths = lines[0] if len(lines) == 1 else MultiLineString(lines)
    least_m = least_radius(space.judged.area, paths.length, len(lines))
    distance = PathDistance(paths, least_m)
    cover = cover_radius(space.judged, distance)
    spread = distance_spread(space.judged, distance)
    # The true water, not the judged one: rules are about the shore as the mission has it, to a centimetre.
    shore = Shore(space.water, request.safety_m, request.least_width_m)
    # 2. How each path by itself keeps the rules, and what threatens it.
    danger = Danger(request.danger_zones)
    conducts = [shore.conduct(track.path, track.launch, track.recovery) for track in request.tracks]
    tracks = tuple(
        _conformance(track, conduct, danger) for track, conduct in zip(request.tracks, conducts, strict=True)
    )
    # 3. All of it in one message, the caller's request identified.
    certificate = Certificate(
        **_together(tracks),
        **_water(space),
        **_coverage(cover, spread, least_m),
        **_evenness(request, paths, space, least_m),
        **_kriging(request, paths, spread, least_m),
        # The caller compares it with its own request: an answer about another path must not pass for this one's.
        request_digest=codec.digest(request),
        tracks=tracks if len(tracks) > 1 else (),
        faults=tuple(
            msgspec.structs.replace(fault, track=number)
            for number, conduct in enumerate(conducts)
            for fault in conduct.faults
        ),
    )
    return Judgement(certificate, paths, space, cover, spread)


def _conformance(track: Track, conduct: Conduct, danger: Danger) -> Conformance:
    path = track.path
    return Conformance(
        length_m=path.length,
        duration_s=path.length / track.speed_mps,
        waypoints=int(shapely.get_num_coordinates(path)),
        is_simple=conduct.crossings == 0,
        crossings=conduct.crossings,
        outside_m=conduct.outside_m,
        unsafe_m=conduct.unsafe_m,
        danger=danger.probability(shapely.get_coordinates(path)) if danger.zones else None,
        legs=conduct.legs,
    )


def _together(tracks: tuple[Conformance, ...]) -> dict[str, Any]:
    """Sums of counts and lengths over the paths; the mission lasts as long as its longest path.

    Vehicles come to harm independently of one another, so the probabilities of no harm multiply.
    """
    sums = {
        name: sum(getattr(track, name) for track in tracks)
        for name in ("length_m", "waypoints", "crossings", "outside_m", "unsafe_m")
    }
    duration_s = max(track.duration_s for track in tracks)
    dangers = [track.danger for track in tracks if track.danger is not None]
    return sums | {
        "duration_s": duration_s,
        "is_simple": all(track.is_simple for track in tracks),
        "danger": float(1.0 - np.prod(1.0 - np.array(dangers))) if dangers else None,
        "legs": tracks[0].legs if len(tracks) == 1 else (),
    }


def _water(space: JudgedSpace) -> dict[str, Any]:
    """How much water there is, and how much of it is judged."""
    return {
        "components": len(space.free.geoms),
        "free_area_m2": space.asked.area,
        "judged_area": space.judged_area,
    }


def _coverage(cover: CoverRadius, spread: DistanceSpread, least_m: float) -> dict[str, Any]:
    """How far the water is from the nearest path."""
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


def _evenness(request: CertifyRequest, paths: Paths, space: JudgedSpace, least_m: float) -> dict[str, Any]:
    """How evenly the paths sample places and directions; distances of legs are taken within each path."""
    spacing_m = 2.0 * least_m
    # Near launch and recovery legs run side by side on purpose: distances there say nothing about the survey.
    margin_m = max(2.0 * request.safety_m, spacing_m)
    apart_m = [
        least_leg_distance(track.path, spacing_m, about_ends(space.free, (track.launch, track.recovery), margin_m))
        for track in request.tracks
    ]
    positions = discrepancy(space.judged, paths, spacing_m, 2.0 * space.detail_m)
    return {
        "least_leg_distance_m": min((least for least in apart_m if least is not None), default=None),
        "discrepancy": positions.value if positions else None,
        "discrepancy_ratio": positions.ratio if positions else None,
        "directional_evenness": directional_evenness(paths),
        "turns": sum(count_turns(track.path, least_m) for track in request.tracks),
    }


def _kriging(request: CertifyRequest, paths: Paths, spread: DistanceSpread, least_m: float) -> dict[str, Any]:
    """How well the field can be reconstructed from samples along the paths, if its variogram is known."""
    if request.variogram is None:
        return {}
    variance = kriging_variance(paths, spread.places, request.variogram, least_m)
    return {"kriging_variance_mean": variance.mean, "kriging_variance_max": variance.max}
