"""PyVRP as the solver, where it is installed (`pip install oxbow[tour]`).

PyVRP (Wouda, Lan and Kool 2024; MIT licence, 5 MB) was written for many vehicles: it has no 2-opt within one
vehicle's route. Of 1 500 sites it finds in 90 s a tour that is 2 % longer than the project's own in 1 s (and
OR-Tools' routing library, 170 MB, one that is 8 % longer in 20 s). So it starts from the project's own tour.
"""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import numpy as np

from oxbow.arrays import Indices
from oxbow_path.tour.local_search import shortened_tour
from oxbow_path.tour.solver import TourSolution
from oxbow_path.tour.start import Start

__all__ = ["is_installed", "polished_tour"]

MOST_SITES = 3000
"""PyVRP keeps all distances: more sites are left as they are."""

ITERATIONS = 100

UNITS = 1000
"""PyVRP computes with integers: the mean distance of near sites is this many."""

FORBIDDEN = 1000
"""What a leg between sites that are not near costs, in mean distances."""


def is_installed() -> bool:
    """Whether PyVRP can be imported."""
    return find_spec("pyvrp") is not None


def polished_tour(start: Start, *, seed: int) -> TourSolution:
    """Shorten a tour by the project's own search, then by PyVRP's: a `Solver`.

    Parameters
    ----------
    start
        A tour, and the distances of near sites.
    seed
        Of both searches.

    Returns
    -------
    Solution
        PyVRP's tour where it is the shorter one and keeps to legs of near sites; else the project's own.
    """
    own = shortened_tour(start, seed=seed)
    # 3000 sites are nine million distances, some 70 MB.
    if len(own.order) > MOST_SITES:
        return own
    order = _solved(start, own.order, seed)
    is_near = bool(np.asarray(start.distances[order, np.roll(order, -1)]).all())
    shorter = is_near and start.length_m(order) < start.length_m(own.order)
    return TourSolution(order, "PyVRP") if shorter else own


def _solved(start: Start, order: Indices, seed: int) -> Indices:
    """PyVRP's tour: one vehicle from the first site of `order`, the depot, to all others and back."""
    import pyvrp  # noqa: PLC0415
    from pyvrp.stop import MaxIterations  # noqa: PLC0415

    # PyVRP takes whole numbers: lengths in units of the mean, and a forbidden step longer than any tour.
    distances = start.distances[order][:, order].toarray()
    mean_m = distances[distances > 0.0].mean()
    costs: Any = np.where(distances > 0.0, np.round(distances * (UNITS / mean_m)), UNITS * FORBIDDEN).astype(
        np.int64
    )
    np.fill_diagonal(costs, 0)
    count = len(order)
    # A travelling salesman is a fleet of one, from a depot that is one of the sites; places are not used.
    problem = pyvrp.ProblemData(
        locations=[pyvrp.Location(0.0, 0.0) for _ in range(count)],
        clients=[pyvrp.Client(location) for location in range(1, count)],
        depots=[pyvrp.Depot(0)],
        vehicle_types=[pyvrp.VehicleType()],
        distance_matrices=[costs],
        duration_matrices=[np.zeros_like(costs)],
    )
    result = pyvrp.solve(
        problem,
        MaxIterations(ITERATIONS),
        # Seeds of missions go up to 2^53, PyVRP's to 2^32.
        seed=seed % 2**32,
        collect_stats=False,
        display=False,
        initial_solution=pyvrp.Solution(problem, [list(range(count - 1))]),
    )
    # Clients count from 0, without the depot: in the matrix they are one later.
    (route,) = result.best.routes()
    clients = [activity.idx for activity in route if activity.is_client()]
    return order[[0, *(client + 1 for client in clients)]]
