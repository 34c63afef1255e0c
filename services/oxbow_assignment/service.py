"""The stage `assignment`: shares of the water for masters, hot spots for slaves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from msgspec import structs

from oxbow.contracts import Assignment, AssignRequest, Role, Sortie, Vehicle
from oxbow.contracts.budget import nominal_spacing_m
from oxbow.geometry.route import Danger
from oxbow.wire.recording import Show
from oxbow_assignment.shares.approach import Harbour
from oxbow_assignment.shares.sharing import share_water
from oxbow_assignment.show import show_campaign, show_partition, show_shares
from oxbow_assignment.treatment.campaign import Campaign, plan_campaign
from oxbow_assignment.treatment.sorties import Journey

__all__ = ["handle"]


def handle(request: AssignRequest, show: Show) -> Assignment:
    """Share the free space among the masters, and the hot spots among the slaves.

    Parameters
    ----------
    request
        What is to be shared among which vehicles.
    show
        Takes the layers of the recording.

    Returns
    -------
    Assignment
        Shares only where they are asked for, sorties only where there are hot spots to be treated.

    Raises
    ------
    InvalidRequest
        No vehicle has the role that is needed, hot spots overlap, or a number is out of proportion.
    Infeasible
        A vehicle cannot reach the free space and get home within its range.
    """
    # 1. Shares of the free space, each connected.
    reply = _shared(request, show) if request.share_free else Assignment()
    if not request.hot_spots or request.swath_m is None:
        return reply

    # 2. Passes over every hot spot, in parts that fit, assigned to the slaves round after round.
    slaves = _with_role(request.vehicles, Role.SLAVE)
    danger = Danger(request.danger_zones, request.danger_detour_m)
    campaign = plan_campaign(
        request.hot_spots,
        slaves,
        request.free,
        request.swath_m,
        water=request.water,
        danger=danger,
        router=request.router,
        seed=request.seed,
    )
    first, *others = campaign.schedule.rounds or ((),)

    # 3. The plan is measured and shown.
    sorties = _sorties(first, campaign)
    further = tuple(sortie for journeys in others for sortie in _sorties(journeys, campaign))
    show_campaign(request.hot_spots, campaign, sorties, further, show)
    solution = campaign.schedule.first
    return structs.replace(
        reply,
        sorties=sorties,
        further=further,
        left=campaign.left,
        treated_share=campaign.treated_share(first, request.swath_m),
        makespan_s=max((sortie.duration_s for sortie in sorties), default=0.0),
        joint_gap=None if solution is None else solution.best_gap.relative,
        warnings=(*reply.warnings, *campaign.warnings, *_unknown_spots(request, slaves)),
    )


def _shared(request: AssignRequest, show: Show) -> Assignment:
    """The free space shared among the masters."""
    masters = _with_role(request.vehicles, Role.MASTER)
    sharing = share_water(request.free, masters, request.footprint_m, request.water)
    spacing_m = request.spacing_m or nominal_spacing_m(
        request.free.area, sum(master.length_m for master in masters)
    )
    harbour = Harbour(request.free, request.water or request.free, spacing_m)
    shares = tuple(harbour.share(area, master) for master, area in zip(masters, sharing.areas, strict=True))
    if sharing.partition is not None:
        show_partition(sharing.partition, show)
    show_shares(shares, show)
    return Assignment(
        shares=shares, imbalance=sharing.imbalance, dropped=sharing.dropped, warnings=sharing.warnings
    )


def _unknown_spots(request: AssignRequest, slaves: Sequence[Vehicle]) -> Iterator[str]:
    """Warnings about danger factors for hot spots that do not exist."""
    names = {spot.name for spot in request.hot_spots}
    for slave in slaves:
        for name in sorted(slave.danger_factors.keys() - names):
            yield f"a danger factor of vehicle {slave.name!r} is for {name!r}, which is no hot spot to be treated"


def _with_role(vehicles: Sequence[Vehicle], role: Role) -> tuple[Vehicle, ...]:
    return tuple(vehicle for vehicle in vehicles if vehicle.role is role)


def _sorties(journeys: Sequence[Journey], campaign: Campaign) -> tuple[Sortie, ...]:
    """Journeys as messages; a hot spot is named once, even if a sortie treats several parts of it."""
    sorties = []
    for journey in journeys:
        slave = campaign.fleet.slaves[journey.slave]
        parts = [campaign.division.parts[number] for number in journey.parts]
        names = [campaign.treatments[part.treatment].spot.name for part in parts]
        sorties.append(
            Sortie(
                vehicle=slave.name,
                path=journey.path,
                hot_spots=tuple(dict.fromkeys(names)),
                length_m=journey.path.length,
                duration_s=journey.path.length / slave.speed_mps,
            )
        )
    return tuple(sorties)
