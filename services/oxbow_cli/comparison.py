"""Two completed Mission Files side by side: by which measures each is better."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import shapely

from oxbow.contracts import Message
from oxbow.mission.file import Mission
from oxbow.site.site import Site
from oxbow_cli.arguments import naming
from oxbow_cli.evaluation import Evaluation, evaluate

__all__ = ["Comparison", "compare"]

LESS_IS_BETTER = (
    "crossings",
    "outside_m",
    "unsafe_m",
    "danger",
    "starts_at_launch_m",
    "ends_at_recovery_m",
    "cover_radius_m",
    "q",
    "mean_distance_m",
    "p95_distance_m",
    "p99_distance_m",
    "mean_ratio",
    "p95_ratio",
    "p99_ratio",
    "discrepancy",
    "discrepancy_ratio",
    "turns",
    "kriging_variance_mean",
    "kriging_variance_max",
)
MORE_IS_BETTER = ("is_simple", "judged_area", "least_leg_distance_m", "directional_evenness")

OF_ANY_MISSION = frozenset(
    {"is_simple", "crossings", "outside_m", "unsafe_m", "starts_at_launch_m", "ends_at_recovery_m", "judged_area"}
    | {"q", "mean_ratio", "p95_ratio", "p99_ratio", "discrepancy_ratio", "directional_evenness"}
)
"""Measures that compare paths of different missions: rules, and ratios to what is possible in each."""

EQUAL = 0.01
"""Values that differ by no more than this fraction are equal: bounds of the cover radius are as far apart."""

EQUAL_M = 0.01
"""Metres that do not matter: about the rounding of degrees in a file."""


class Comparison(Message, frozen=True, kw_only=True):
    """Two evaluations: by which measures each is better, which rules each breaks, and how the missions differ.

    If the missions differ, only measures that do not depend on the mission are compared.
    """

    first: Evaluation
    second: Evaluation
    first_better: tuple[str, ...]
    second_better: tuple[str, ...]
    first_breaks: tuple[str, ...]
    second_breaks: tuple[str, ...]
    differences: tuple[str, ...]


def compare(first: Mission, second: Mission, *, names: tuple[str, str] = ("first", "second")) -> Comparison:
    """Evaluate the paths of two missions, and find by which measures each is better.

    Parameters
    ----------
    first, second
        Completed missions.
    names
        How errors call the two.

    Returns
    -------
    Comparison
        Measures that are equal, or that either lacks, are better in neither.

    Raises
    ------
    InvalidMission
        One has no path, or its geometry breaks a rule.
    Infeasible
        The zones or the safety distance leave no water to judge on.
    """
    with naming(names[0]):
        one = evaluate(first)
    with naming(names[1]):
        other = evaluate(second)
    differences = tuple(_differences(first, second))
    measures = [name for name in (*MORE_IS_BETTER, *LESS_IS_BETTER) if not differences or name in OF_ANY_MISSION]
    return Comparison(
        first=one,
        second=other,
        first_better=tuple(name for name in measures if _is_better(name, one, other)),
        second_better=tuple(name for name in measures if _is_better(name, other, one)),
        first_breaks=tuple(_broken_rules(one)),
        second_breaks=tuple(_broken_rules(other)),
        differences=differences,
    )


def _differences(first: Mission, second: Mission) -> Iterator[str]:
    """How two missions differ in what matters to the judgement of a path."""
    here, there = Site.of(first), Site.of(second)
    # Outlines are in normal form: a contour that begins elsewhere is still the same. Planes are compared too,
    # since
    # equal coordinates in two of them are two places.
    if (here.frame, here.outline) != (there.frame, there.outline):
        areas_km2 = here.outline.area / 1e6, there.outline.area / 1e6
        yield "{}: {:.4g} and {:.4g} km2 within".format(first.outline_name, *areas_km2)
    elif not shapely.union_all(here.zones).equals(shapely.union_all(there.zones)):
        yield f"ForbiddenZones: {len(here.zones)} and {len(there.zones)}, not the same"
    if first.danger_zones != second.danger_zones:
        yield f"DangerZones: {len(here.danger_zones)} and {len(there.danger_zones)}, not the same"
    for name, one_m, other_m in (
        ("Safety", first.safety_m, second.safety_m),
        ("Master_length", first.master_length_m, second.master_length_m),
    ):
        if one_m != other_m:
            yield f"{name}: {one_m:g} and {other_m:g} m"


def _broken_rules(found: Evaluation) -> Iterator[str]:
    if not found.is_simple:
        yield f"crosses itself ({found.crossings})"
    # What a place ashore makes necessary is no breach; what goes beyond it is.
    necessary_m = sum(min(leg.ashore_m, leg.least_ashore_m) for path in found.vehicles for leg in path.legs)
    if found.outside_m - necessary_m > EQUAL_M:
        yield f"{found.outside_m - necessary_m:.1f} m outside"
    if found.unsafe_m > EQUAL_M:
        yield f"{found.unsafe_m:.1f} m within Safety"
    if found.length_ratio > 1.0:
        yield f"longer than allowed by {found.length_ratio - 1.0:.2%}"
    if found.starts_at_launch_m > EQUAL_M:
        yield f"starts {found.starts_at_launch_m:.1f} m from the launch point"
    if found.ends_at_recovery_m > EQUAL_M:
        yield f"ends {found.ends_at_recovery_m:.1f} m from the recovery point"


def _is_better(name: str, one: Evaluation, other: Evaluation) -> bool:
    ours, theirs = _figure(getattr(one, name)), _figure(getattr(other, name))
    if ours is None or theirs is None:
        return False
    if math.isclose(ours, theirs, rel_tol=EQUAL, abs_tol=EQUAL_M if name.endswith("_m") else 0.0):
        return False
    return ours > theirs if name in MORE_IS_BETTER else ours < theirs


def _figure(value: Any) -> float | None:
    """The number by which a measure is compared; of bounds, the upper one."""
    if isinstance(value, tuple):
        return float(value[-1])
    return None if value is None else float(value)
