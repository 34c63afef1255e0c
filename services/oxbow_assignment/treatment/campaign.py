"""A campaign over hot spots: passes, parts that fit, sorties, and what is left."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.contracts import HotSpot, LeftSpot, Vehicle
from oxbow.geometry.route import NO_DANGER, Danger, RouteMethod, make_router
from oxbow_assignment.treatment.division import Division, divide_treatments
from oxbow_assignment.treatment.fleet import Fleet
from oxbow_assignment.treatment.sorties import Journey, Schedule, schedule_sorties
from oxbow_assignment.treatment.spots import require_treatable, waters
from oxbow_assignment.treatment.treatment import Treatment, treatment_of

__all__ = ["Campaign", "plan_campaign"]

NOTED = 0.01
"""The fraction of a hot spot outside the free space from which there is a warning."""


@dataclass(frozen=True)
class Campaign:
    """The whole treatment of some hot spots.

    Parameters
    ----------
    waters
        The part of each hot spot in the free space.
    fleet
        The slaves.
    treatments
        One for each hot spot with water.
    division
        Their parts, and the stretches out of reach.
    schedule
        The journeys that treat all parts.
    left
        Hot spots of which something is left untreated, the greatest value per metre first.
    """

    waters: tuple[BaseGeometry, ...]
    fleet: Fleet
    treatments: tuple[Treatment, ...]
    division: Division
    schedule: Schedule
    left: tuple[LeftSpot, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about hot spots that lie partly outside the free space."""
        return tuple(_outside_warnings(self.treatments))

    def treated_share(self, journeys: Sequence[Journey], swath_m: float) -> tuple[float, ...]:
        """The fraction of each hot spot's water within half a swath of journeys; 0 where there is no water.

        Parameters
        ----------
        journeys
            Those that count.
        swath_m
            The width that one pass treats.

        Returns
        -------
        tuple of float
            In the order of the hot spots, from 0 to 1.
        """
        return tuple(
            0.0 if water.is_empty else _swaths(journeys, water, swath_m).intersection(water).area / water.area
            for water in self.waters
        )


def _swaths(journeys: Sequence[Journey], water: BaseGeometry, swath_m: float) -> BaseGeometry:
    """The swaths of journeys near some water; clipped first, so that only what is near is buffered."""
    x0, y0, x1, y1 = water.bounds
    near = [
        shapely.clip_by_rect(journey.path, x0 - swath_m, y0 - swath_m, x1 + swath_m, y1 + swath_m)
        for journey in journeys
    ]
    return shapely.union_all(shapely.buffer(near, swath_m / 2))


def plan_campaign(
    spots: Sequence[HotSpot],
    slaves: Sequence[Vehicle],
    free: Polygon,
    swath_m: float,
    *,
    water: Polygon | None = None,
    danger: Danger = NO_DANGER,
    router: RouteMethod = RouteMethod.VISIBILITY,
    seed: int = 0,
) -> Campaign:
    """Plan the treatment of hot spots (Rendas and Li 2016, introduction).

    Parameters
    ----------
    spots
        What is to be treated.
    slaves
        The vehicles that treat it; at least one.
    free
        Where they may go.
    swath_m
        The width that one pass treats.
    water
        What legs to and from the free space may cross; by default the free space alone.
    danger
        What routes to, between and from hot spots avoid; passes over a hot spot do not.
    router
        How these routes are found.
    seed
        Seed of the clustering.

    Returns
    -------
    Campaign
        With an empty schedule where nothing can be treated.

    Raises
    ------
    InvalidRequest
        Hot spots overlap, share a name or have no value; there is no slave; or the swath is far too small.
    Infeasible
        A slave's range is too short to reach the free space and go home, or it would take hundreds of sorties.
    """
    require_treatable(spots)
    shapely.prepare(free)  # thousands of lines are tested against it
    # 1. Who treats, and what: only the water of each hot spot counts.
    fleet = Fleet.of(slaves, free, free if water is None else water, danger, router)
    found = tuple(waters(spots, free))
    # Between passes there is next to nothing to choose: the funnel finds the shortest way, and at once.
    between_passes = make_router(RouteMethod.FUNNEL, free)
    treatments = tuple(
        treatment_of(spot, water, free, between_passes, swath_m)
        for spot, water in zip(spots, found, strict=True)
        if not water.is_empty
    )
    # 2. Passes, in parts that a sortie can reach, and what no sortie reaches.
    division = divide_treatments(treatments, fleet)
    left = [*_dry(spots, found, free), *_out_of_reach(treatments, division, fleet)]
    return Campaign(
        waters=found,
        fleet=fleet,
        treatments=treatments,
        division=division,
        schedule=schedule_sorties(division.parts, fleet, seed=seed),
        left=tuple(sorted(left, key=lambda spot: -spot.value_per_m)),
    )


def _dry(spots: Sequence[HotSpot], found: Sequence[BaseGeometry], free: Polygon) -> list[LeftSpot]:
    return [
        LeftSpot(
            hot_spot=spot.name,
            value_per_m=0.0,
            reason=f"has no water in the free space, {spot.area.distance(free):.0f} m from it: it lies on land,"
            " outside the site, or nearer to the shore than vehicles may go",
        )
        for spot, water in zip(spots, found, strict=True)
        if water.is_empty
    ]


def _out_of_reach(treatments: Sequence[Treatment], division: Division, fleet: Fleet) -> list[LeftSpot]:
    """One entry for each hot spot with stretches that no sortie reaches."""
    counted = ", round danger zones where that is worth it" if fleet.danger.outlines else ""
    left = []
    for number, treatment in enumerate(treatments):
        own = [stretch for stretch in division.out_of_reach if stretch.part.treatment == number]
        if not own:
            continue
        # The reason is that of the stretch that comes nearest to being reached: the others fail by more.
        nearest = min(own, key=lambda stretch: stretch.access_m - fleet.lengths_m[stretch.slave])
        slave = fleet.slaves[nearest.slave]
        share = sum(stretch.part.until - stretch.part.since for stretch in own)
        length_m = treatment.line.length
        reason = (
            f"{share:.0%} of its {length_m:.0f} m of passes are out of reach: {slave.name!r} would travel"
            f" {nearest.access_m:.0f} m there and home{counted}, beside {nearest.part.line.length:.0f} m of"
            f" passes, and may travel {slave.length_m:.0f} m"
        )
        value_per_m = share * treatment.spot.value / (nearest.access_m + share * length_m)
        left.append(LeftSpot(hot_spot=treatment.spot.name, value_per_m=value_per_m, reason=reason))
    return left


def _outside_warnings(treatments: Sequence[Treatment]) -> Iterator[str]:
    for treatment in treatments:
        outside = 1.0 - treatment.water.area / treatment.spot.area.area
        if outside > NOTED:
            yield f"{outside:.0%} of hot spot {treatment.spot.name!r} lies outside the free space"
