"""What every path method is given, and what it gives back."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Protocol

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray
from oxbow.contracts import FreeSpace, PathRequest, SpacingStep, WeightedArea
from oxbow.contracts.budget import nominal_spacing_m
from oxbow.geometry.route import leg_routes
from oxbow.geometry.route.gate_routes import Routes
from oxbow.geometry.sweep import from_sweep, to_sweep
from oxbow.wire.recording import Layer, LayerKind, Show
from oxbow_path.refinement import RefinementStep, Samples
from oxbow_path.walk.access import access
from oxbow_path.walk.legs import Passable
from oxbow_path.walk.probe import Probe
from oxbow_path.walk.spacing import Budget
from oxbow_path.walk.trial import Waters

__all__ = ["Display", "MethodPlan", "PathMethod", "Stop", "Task", "finest_spacing_m", "prepared_waters"]

Stop = Callable[[], bool]
"""Asked now and then whether time is up."""

STAGE = "path"

FINEST = 120
"""The root of the water's area is at most this many spacings: waypoints, and the work, grow with its square."""

FINEST_ALONG = 10_000
"""The length of the shore is at most this many spacings: in canals this bound is the tighter one."""

PROBE_PITCH = 0.35
"""Pitch of the probe grid, in nominal spacings."""

SAMPLE_PITCH = 0.215
"""Pitch of the samples, in nominal spacings: 25 per square of one spacing."""

SHOWN_EVERY = 10
"""One step of an improvement in this many is shown with its path."""

FINEST_M = 0.1
"""The least spacing planned, however small the water: vehicles are not narrower."""

GATES_ALONG = 15_000
"""Routes divide the water by at most about this many gates along its shore."""

MOST_SAMPLES = 100_000
"""Where there would be more samples, or places of the probe, than about this many, their pitch is widened."""


@dataclass(frozen=True)
class Task:
    """A request made ready; geometry in the sweep frame.

    Attributes
    ----------
    request
        What is asked.
    waters
        Where the path may run, and how launch and recovery points are reached.
    budget
        The longest path to plan, and how near its legs may come.
    stop
        Whether time is up.
    """

    request: PathRequest
    waters: Waters
    budget: Budget
    stop: Stop

    @classmethod
    def of(cls, request: PathRequest, stop: Stop, spent_m: float = 0.0) -> Task:
        """Turn a request into the sweep frame, and prepare what all methods share.

        Parameters
        ----------
        request
            What is asked, in the planar frame.
        stop
            Whether time is up.
        spent_m
            What the vehicle needs besides the path; refusals count it in.

        Returns
        -------
        Task
            Its samples and areas are computed when a method first asks for them.

        Raises
        ------
        Infeasible
            No water leads from the launch or the recovery point to the free space.
        """
        # The finest spacing bounds the work, whatever the length would allow.
        least_spacing_m = max(request.min_spacing_m, finest_spacing_m(request.space))
        nominal_m = nominal_spacing_m(request.space.free.area, request.length_m, least_spacing_m)
        waters = prepared_waters(request, nominal_m)
        return cls(request, waters, Budget(request.length_m, least_spacing_m, spent_m), stop)

    @property
    def spacing_m(self) -> float:
        """The nominal spacing (`oxbow.contracts.budget`)."""
        return self.waters.spacing_m

    @property
    def useful_length_m(self) -> float:
        """The length that is worth travelling: what the least spacing asks for, or the longest there may be."""
        return min(self.budget.most_m, self.waters.free.area / self.spacing_m)

    @property
    def enough_m(self) -> float:
        """A path this near to all water is good enough: half the least spacing, or 0 where length is short."""
        return self.spacing_m / 2 if self.spacing_m <= self.budget.least_spacing_m else 0.0

    @cached_property
    def areas(self) -> tuple[WeightedArea, ...]:
        """Where sampling is to be denser, or less dense."""
        turn = partial(to_sweep, heading_rad=self.request.decomposition.heading_rad)
        return tuple(
            WeightedArea(area=shapely.transform(entry.area, turn), weight=entry.weight)
            for entry in self.request.weighted_areas
        )

    @cached_property
    def samples(self) -> Samples:
        """The places that the path is to come near to."""
        return Samples.over(
            self.waters.free, _pitch_m(self.waters.free, SAMPLE_PITCH * self.spacing_m), self.areas
        )


@dataclass(frozen=True)
class MethodPlan:
    """A method's path from launch to recovery, in the sweep frame, and how it came about.

    Attributes
    ----------
    path
        Simple, and inside the free space except for its legs.
    spacing_m
        The spacing of its parallel legs, or about that of neighbouring ones.
    reach_m
        Water farther from the path than this is named as dropped.
    steps
        The spacings tried, and the lengths that they gave.
    """

    path: LineString
    spacing_m: float
    reach_m: float
    steps: tuple[SpacingStep, ...]


class PathMethod(Protocol):
    """A way to generate a path."""

    def __call__(self, task: Task, display: Display, /) -> MethodPlan: ...


@dataclass(frozen=True)
class Display:
    """Shows what a method makes in the sweep frame, turned back into the planar frame."""

    show: Show
    heading_rad: float

    def lines(
        self, name: str, lines: Sequence[BaseGeometry], *, step: int = 0, labels: tuple[str, ...] = ()
    ) -> None:
        """Show geometry of the sweep frame.

        Parameters
        ----------
        name
            Of the layer.
        lines
            Geometries of any kind, in the sweep frame.
        step
            The iteration that they belong to.
        labels
            One per geometry, or none.
        """
        turned = shapely.transform(np.asarray(lines, dtype=object), self.back) if len(lines) else ()
        self.show(Layer(stage=STAGE, name=name, step=step, geometries=tuple(turned), labels=labels))

    def figures(self, name: str, figures: dict[str, float], *, step: int = 0) -> None:
        """Show figures of one step.

        Parameters
        ----------
        name
            Of the layer.
        figures
            Named values, their units in their names.
        step
            The iteration that they belong to.
        """
        self.show(Layer(stage=STAGE, name=name, kind=LayerKind.SCALARS, step=step, scalars=figures))

    def refinement(self, number: int, step: RefinementStep) -> None:
        """Show where a refinement stands: its figures at every step, the path at some.

        Parameters
        ----------
        number
            Of the step, from 0 for the path as it was given.
        step
            The path, and how far the samples are from it.
        """
        figures = {"length_m": step.length_m, "largest_distance_m": step.largest_m, "p95_distance_m": step.p95_m}
        self.figures("refinement", figures, step=number)
        if number % SHOWN_EVERY == 0:
            self.lines("refined", [step.path], step=number, labels=(f"step {number}",))

    def back(self, points: FloatArray) -> FloatArray:
        """From the sweep frame into the planar one."""
        return from_sweep(points, heading_rad=self.heading_rad)


def finest_spacing_m(space: FreeSpace) -> float:
    """The least spacing that is planned: finer sampling of small waters takes long and serves no purpose.

    Rendas and Li 2016, section 1.2.1.2, find that the spacing needs a least value for small sites.
    """
    return max(FINEST_M, math.sqrt(space.free.area) / FINEST, space.free.length / FINEST_ALONG)


def _pitch_m(free: Polygon, wanted_m: float) -> float:
    """The pitch of places over the free space, widened where there would be too many."""
    return max(wanted_m, math.sqrt(free.area / MOST_SAMPLES))


def prepared_waters(request: PathRequest, spacing_m: float) -> Waters:
    """The waters of a request, in the sweep frame.

    Parameters
    ----------
    request
        What is asked, in the planar frame.
    spacing_m
        The nominal spacing, which scales the pitch of the probe and the detail of routes.

    Returns
    -------
    Waters
        With the legs of launch and recovery, a probe, and routes through the free space.
    """
    turn = partial(to_sweep, heading_rad=request.decomposition.heading_rad)
    free, water = (shapely.transform(polygon, turn) for polygon in (request.space.free, request.space.water))
    # Prepared once: the same polygons are asked thousands of times by every method.
    shapely.prepare([free, water])
    shore = leg_routes(free, water)
    # Everything turns together: methods know no other frame than that of the sweep.
    (launch, recovery) = turn(np.array([request.launch, request.recovery]))
    return Waters(
        spacing_m=spacing_m,
        cells=request.decomposition.cells,
        free=free,
        passable=Passable(free),
        probe=Probe.over(free, _pitch_m(free, PROBE_PITCH * spacing_m)),
        # Routes as fine as the probe; in canals, whose shore is long for their area, no finer than the gates
        # allow.
        routes=Routes(free, max(PROBE_PITCH * spacing_m, free.length / GATES_ALONG)),
        launch=access(tuple(launch), free, shore, where="launch"),
        recovery=access(tuple(recovery), free, shore, where="recovery"),
    )
