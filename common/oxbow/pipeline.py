"""The flow of one mission, from the Mission File to the plan: read this first."""

from __future__ import annotations

from typing import Protocol, TypeVar

from oxbow.completion import completed
from oxbow.contracts import (
    CERTIFY,
    CONTOUR,
    DECOMPOSE,
    PATH,
    CertifyRequest,
    ContourRequest,
    DecomposeRequest,
    Endpoint,
    Message,
    PathRequest,
)
from oxbow.mission import Mission, PlanOptions, require_plannable
from oxbow.site import Site

__all__ = ["Call", "plan_mission"]

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)


class Call(Protocol):
    """Ask a stage: over the bus (`oxbow.bus.BusCall`) or in this process (`oxbow.local.LocalCall`)."""

    def __call__(self, endpoint: Endpoint[Q, R], request: Q, /) -> R: ...


def plan_mission(mission: Mission, options: PlanOptions | None = None, *, call: Call) -> Mission:
    """Plan a mission's nominal path and certify it.

    Parameters
    ----------
    mission
        A checked mission of type ``map`` or ``adap``.
    options
        Method, seed and the like; the defaults of `PlanOptions` where absent.
    call
        How the stages are reached.

    Returns
    -------
    Mission
        The mission with its path and the `Plan` object filled in.

    Raises
    ------
    OxbowError
        Whatever a stage raised: nothing is planned by half.
    """
    options = options or PlanOptions()
    require_plannable(mission)
    site = Site.of(mission)
    space = call(
        CONTOUR,
        ContourRequest(
            outline=site.outline,
            zones=site.zones,
            safety_m=mission.safety_m,
            spacing_m=site.nominal_spacing_m,
            tolerance_m=options.tolerance_m,
        ),
    )
    decomposition = call(
        DECOMPOSE,
        DecomposeRequest(free=space.free, spacing_m=site.nominal_spacing_m, heading_rad=options.heading_rad),
    )
    plan = call(
        PATH,
        PathRequest(
            method=options.method,
            space=space,
            decomposition=decomposition,
            launch=site.launch,
            recovery=site.recovery,
            length_m=mission.master_length_m,
            min_spacing_m=mission.minimal_spatial_rate_m or 0.0,
            seed=options.seed,
            weighted_areas=site.weighted_areas,
            time_limit_s=options.time_limit_s,
            smooth=options.smooth,
            draw=options.draw,
        ),
    )
    certificate = call(
        CERTIFY,
        CertifyRequest(
            outline=site.outline,
            zones=site.zones,
            safety_m=mission.safety_m,
            path=plan.path,
            launch=site.launch,
            recovery=site.recovery,
            speed_mps=mission.master_speed_mps,
            variogram=mission.variogram,
        ),
    )
    return completed(mission, options, site, space, decomposition, plan, certificate)
