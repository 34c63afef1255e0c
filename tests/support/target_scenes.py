"""Scenes of targets and vehicles for tests: points of a plane, or of water with a wall in it."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.distance import cdist

from oxbow.arrays import FloatArray
from oxbow.contracts import Role, Vehicle
from oxbow_assignment.targets.assignment import TargetAssignment
from oxbow_assignment.targets.problem import Objective, Problem

SIDE_M = 1_000.0


def vehicle(
    place=(0.0, 0.0), *, name="boat", length_m=1e5, speed_mps=1.0, role=Role.SLAVE, recovery=None
) -> Vehicle:
    return Vehicle(
        name=name, role=role, speed_mps=speed_mps, length_m=length_m, start=place, recovery=recovery or place
    )


def problem(
    targets: Sequence[tuple[float, float]] | FloatArray,
    vehicles: Sequence[Vehicle],
    *,
    objective: Objective = Objective.TOTAL,
    **more,
) -> Problem:
    """Targets and vehicles in open water."""
    ends = [vehicle.start for vehicle in vehicles] + [vehicle.recovery for vehicle in vehicles]
    points = np.vstack([np.reshape(targets, (-1, 2)), ends])
    return Problem(tuple(vehicles), cdist(points, points), objective, **more)


def random_problem(
    seed: int,
    targets: int,
    vehicles: int,
    *,
    length_m: float = 1e5,
    objective: Objective = Objective.TOTAL,
    **more,
) -> Problem:
    """Targets and starts anywhere in a square; speeds of 1 to 2 m/s, recoveries apart from starts."""
    random = np.random.default_rng(seed)
    places = random.uniform(0.0, SIDE_M, (targets + 2 * vehicles, 2))
    fleet = [
        vehicle(
            tuple(places[targets + i]),
            name=f"boat {i}",
            length_m=length_m * random.uniform(0.8, 1.2),
            speed_mps=random.uniform(1.0, 2.0),
            recovery=tuple(places[targets + vehicles + i]),
        )
        for i in range(vehicles)
    ]
    return problem(places[:targets], fleet, objective=objective, **more)


def require_sound(problem: Problem, assignment: TargetAssignment) -> None:
    """Every target is once in a tour or among the unserved; every tour is as long as it says, and within range."""
    served = [target for tour in assignment.tours for target in tour.targets]
    assert sorted([*served, *(unserved.target for unserved in assignment.unserved)]) == list(range(problem.count))
    assert len(assignment.tours) == len(problem.vehicles)
    for index, (vehicle, tour) in enumerate(zip(problem.vehicles, assignment.tours, strict=True)):
        path = problem.path(index, tour.targets)
        length_m = problem.distances[path[:-1], path[1:]].sum() if tour.targets else 0.0
        assert tour.vehicle == vehicle.name
        assert np.isclose(tour.length_m, length_m)
        assert np.isclose(tour.duration_s, length_m / vehicle.speed_mps)
        assert tour.length_m <= vehicle.length_m
        assert problem.has_role[index, list(tour.targets)].all()
    assert np.isclose(assignment.value, problem.values[served].sum())
