"""Meshes, shares and border-to-core paths, beside the figures of Balampanis, Maza and Ollero (2016)."""

from __future__ import annotations

import importlib
import importlib.util
import math
import time
from collections.abc import Iterator

import numpy as np
import shapely
from shapely import Polygon, box

from oxbow_assignment.shares.mesh import Mesh, mesh_area, propagate
from oxbow_assignment.shares.mesh.triangulation import Triangulation
from oxbow_assignment.shares.partition import BALANCE, balanced_partition, wavefront_partition
from tests.bench.cell_paths import coverage_depth, shortest_path, watershed_path
from tests.bench.results import Figure, Goal, Section

__all__ = ["measure"]

FOOTPRINTS_M = (15.0, 20.0, 25.0, 30.0)
BOUNDS_DEG = (0.0, 10.0, 15.0, 20.0, 25.0, 30.0)
CGAL_BOUNDS_DEG = (0.0, 10.0, 15.0, 20.0)
"""CGAL's refinement ends for certain below 20.7 degrees only."""

PAPER_CELLS = {15.0: (331, 1395, 125), 20.0: (211, 784, 99), 25.0: (138, 476, 73), 30.0: (104, 352, 64)}
"""Its Table II: square cells, triangles, square cells partly outside."""

PAPER_AREA_M2 = 64_000.0
"""About what its square cells cover: those inside and half of those that are not."""

PAPER_TIME_S = 0.23
"""Section VII, of 477 cells: meshing, sharing among three and one coverage path."""

VEHICLES = (2, 3, 8)
SIZES_M = (20.0, 10.0, 5.0)


def measure() -> Iterator[Section]:
    """Four tables: grid against mesh, angles against the bound, times, and shares."""
    site = _site()
    yield _grid_against_mesh(site)
    yield _angles(site)
    yield _times(site)
    yield Section("Shares of the site", [_shares(site, vehicles) for vehicles in VEHICLES])


def _site() -> Polygon:
    """A coast of the paper's kind and size (its Figure 6): 17 vertices, a no-fly zone of 4, scaled to 1 : 10."""
    turn = np.linspace(0.0, 2.0 * np.pi, 17, endpoint=False)
    radius = 1.0 + 0.25 * np.cos(3.0 * turn + 0.5) + 0.12 * np.sin(5.0 * turn) + 0.1 * np.cos(2.0 * turn)
    zone = [(-0.25, -0.15), (-0.15, 0.3), (0.2, 0.25), (0.25, -0.2)]
    site = Polygon(np.column_stack([radius * np.cos(turn), radius * np.sin(turn)]), [zone])
    scale = math.sqrt(PAPER_AREA_M2 / site.area)
    return shapely.transform(site, lambda xy: scale * xy)


def _grid_against_mesh(site: Polygon) -> Section:
    rows: list[dict[str, Figure]] = []
    for footprint_m in FOOTPRINTS_M:
        whole, partial = _square_cells(site, footprint_m)
        mesh = mesh_area(site, footprint_m)
        outside = shapely.area(shapely.difference(mesh.polygons, site)) > 1e-9 * footprint_m**2
        squares, triangles, partly = PAPER_CELLS[footprint_m]
        rows.append(
            {
                "footprint, m": footprint_m,
                "squares": whole + partial,
                "paper's squares": squares,
                "partly outside": partial,
                "paper's partly": partly,
                "triangles": len(mesh),
                "paper's triangles": triangles,
                "triangles partly outside": int(np.count_nonzero(outside)),
            }
        )
    worst = max(float(row["triangles partly outside"]) for row in rows)
    return Section("Square grid against mesh", rows, [Goal("triangles partly outside", worst, at_most=0)])


def _square_cells(site: Polygon, footprint_m: float) -> tuple[int, int]:
    """Squares of a grid inside a site, and those partly outside it."""
    x0, y0, x1, y1 = site.bounds
    x, y = np.meshgrid(np.arange(x0, x1, footprint_m), np.arange(y0, y1, footprint_m))
    covered = shapely.area(shapely.intersection(box(x, y, x + footprint_m, y + footprint_m), site))
    whole = int(np.count_nonzero(covered > (1 - 1e-9) * footprint_m**2))
    return whole, int(np.count_nonzero(covered > 1e-9 * footprint_m**2)) - whole


def _angles(site: Polygon) -> Section:
    """Table I of the paper, on an even and on a ragged border; its mesher beside, where that is installed."""
    rows = []
    for border, area in (("even", site), ("ragged", _ragged(site))):
        rows += [
            _angle_row(border, "Oxbow", bound, mesh_area(area, 25.0, least_angle_deg=bound))
            for bound in BOUNDS_DEG
        ]
        if importlib.util.find_spec("CGAL"):
            rows += [_angle_row(border, "CGAL", bound, _cgal_mesh(area, 25.0, bound)) for bound in CGAL_BOUNDS_DEG]
    return Section(
        "Angles of the mesh, footprint 25 m",
        rows,
        [
            Goal(
                "least angle without a bound, even border,",
                float(rows[0]["least angle, deg"]),
                " deg",
                at_least=34.0,
            )
        ],
        note="the paper's, on its site: 25 degrees and 476 cells without a bound, 34 degrees and 597 at most",
    )


def _cgal_mesh(area: Polygon, edge_m: float, bound_deg: float) -> Mesh:
    """The mesh that the paper's mesher makes (Delaunay refinement of CGAL); it puts in point by point."""
    mesh_2 = importlib.import_module("CGAL.CGAL_Mesh_2")
    kernel = importlib.import_module("CGAL.CGAL_Kernel")
    triangulation = mesh_2.Mesh_2_Constrained_Delaunay_triangulation_2()
    for ring in (area.exterior, *area.interiors):
        vertices = [triangulation.insert(kernel.Point_2(*place)) for place in list(ring.coords)[:-1]]
        for here, there in zip(vertices, [*vertices[1:], vertices[0]], strict=True):
            triangulation.insert_constraint(here, there)
    holes = [Polygon(ring).representative_point().coords[0] for ring in area.interiors]
    criteria = mesh_2.Delaunay_mesh_size_criteria_2(math.sin(math.radians(bound_deg)) ** 2, edge_m)
    mesh_2.refine_Delaunay_mesh_2(triangulation, [kernel.Point_2(*hole) for hole in holes], criteria)
    faces = [face for face in triangulation.finite_faces() if face.is_in_domain()]
    places = [face.vertex(k).point() for face in faces for k in range(3)]
    points, index = np.unique([(place.x(), place.y()) for place in places], axis=0, return_inverse=True)
    return Mesh.of(Triangulation(points, index.reshape(-1, 3)))


def _ragged(site: Polygon) -> Polygon:
    """The site with a vertex every 4 m, moved by noise."""
    rng = np.random.default_rng(0)
    fine = shapely.segmentize(site, 4.0)
    rings = (shapely.get_coordinates(ring)[:-1] for ring in (fine.exterior, *fine.interiors))
    outline, *zones = (ring + rng.normal(0.0, 0.5, ring.shape) for ring in rings)
    return Polygon(outline, zones)


def _angle_row(border: str, mesher: str, bound_deg: float, mesh: Mesh) -> dict[str, Figure]:
    statistics = mesh.angle_statistics
    return {
        "border": border,
        "mesher": mesher,
        "bound, deg": bound_deg,
        "points": len(mesh.points),
        "triangles": len(mesh),
        "least edge, m": statistics.shortest_edge_m,
        "mean edge, m": statistics.mean_edge_m,
        "least angle, deg": statistics.least_deg,
        "1st percentile": statistics.low_deg,
        "mean least angle": statistics.mean_least_deg,
    }


def _times(site: Polygon) -> Section:
    rows = [_time_row(site, edge_m) for edge_m in (25.0, *SIZES_M)]
    return Section(
        "Time of mesh, shares and paths of three vehicles, s",
        rows,
        [Goal("all, at a footprint of 25 m,", float(rows[0]["all"]), " s", at_most=PAPER_TIME_S)],
        note=f"the paper's: {PAPER_TIME_S} s for 477 cells",
    )


def _time_row(site: Polygon, edge_m: float) -> dict[str, Figure]:
    start = site.exterior.coords[0][:2]
    clock = [time.perf_counter()]
    mesh = mesh_area(site, edge_m)
    clock.append(time.perf_counter())
    shares = wavefront_partition(mesh, [start] * 3)
    clock.append(time.perf_counter())
    path = watershed_path(mesh, shares.seeds[0], shares.share == 0)
    clock.append(time.perf_counter())
    shortest_path(mesh, propagate(mesh, shares.seeds), len(mesh) - 1)
    clock.append(time.perf_counter())
    balanced_partition(mesh, [start] * 3)
    clock.append(time.perf_counter())
    mesh_s, wave_s, cover_s, shortest_s, balance_s = np.diff(clock).tolist()
    return {
        "footprint, m": edge_m,
        "triangles": len(mesh),
        "mesh": mesh_s,
        "wavefronts": wave_s,
        "coverage path": cover_s,
        "its revisits": path.revisits,
        "shortest path": shortest_s,
        "all": mesh_s + wave_s + cover_s,
        "balanced shares": balance_s,
    }


def _shares(site: Polygon, vehicles: int) -> dict[str, Figure]:
    mesh: Mesh = mesh_area(site, math.sqrt(4 / math.sqrt(3) * site.area / (200 * vehicles)))
    start, capacities = site.exterior.coords[0][:2], np.arange(vehicles) % 3 + 1.0
    waves = wavefront_partition(mesh, [start] * vehicles, capacities)
    balanced = balanced_partition(mesh, [start] * vehicles, capacities)
    assert balanced.imbalance <= BALANCE
    depth = coverage_depth(balanced.mesh, balanced.share == 0)
    return {
        "vehicles": vehicles,
        "triangles": len(balanced.mesh),
        "imbalance of wavefronts": waves.imbalance,
        "border, m": waves.border_m,
        "imbalance": balanced.imbalance,
        "its border, m": balanced.border_m,
        "levels of the first share": int(depth.max()) + 1,
    }
