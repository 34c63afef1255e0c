"""Make the example missions of this folder; every number is fixed, so that every run gives the same files.

The waters are invented; their places on the map are only there to have degrees.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
import shapely
from shapely import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from oxbow.arrays import FloatArray
from oxbow.contracts import Role, Variogram, VariogramModel
from oxbow.geometry.frame import Frame, Position
from oxbow.mission.danger_zones import GivenDangerZone
from oxbow.mission.file import Bloom, Mission, MissionType, write_mission
from oxbow.mission.prior import PriorFeature, PriorModel, prior_document
from oxbow.mission.vehicles import GivenVehicle

FOLDER = Path(__file__).parent
DECIMALS = 6
"""Of a degree: a tenth of a metre."""


def blob(x: float, y: float, radius_m: float, rng: np.random.Generator, roughness: float = 0.25) -> Polygon:
    """A rounded shape: a circle whose radius varies smoothly with the angle."""
    angle = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
    order = np.arange(2, 9)
    weight = roughness * rng.normal(size=7) / order
    phase = rng.uniform(0.0, 2.0 * np.pi, 7)
    radius = radius_m * (1.0 + (weight * np.cos(angle[:, None] * order + phase)).sum(axis=1))
    return Polygon(np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)]))


def channel(points: Sequence[tuple[float, float]], widths_m: Sequence[float]) -> Polygon:
    """A smooth channel through points, whose width goes from one value to the next."""
    given = np.linspace(0.0, 1.0, len(points))
    at = np.linspace(0.0, 1.0, 40 * len(points))
    nodes = np.asarray(points, dtype=np.float64)
    window = np.hanning(41) / np.hanning(41).sum()
    line = np.column_stack(
        [np.convolve(np.pad(np.interp(at, given, nodes[:, axis]), 20, "edge"), window, "valid") for axis in (0, 1)]
    )
    width = np.interp(at, np.linspace(0.0, 1.0, len(widths_m)), widths_m)
    pieces = shapely.buffer(shapely.linestrings(np.stack([line[:-1], line[1:]], axis=1)), width[1:] / 2.0)
    merged = shapely.union_all(pieces)
    assert isinstance(merged, Polygon)
    return Polygon(merged.exterior)


def ragged(shape: Polygon, step_m: float, amplitude_m: float, rng: np.random.Generator) -> Polygon:
    """The shape with a vertex every `step_m` or so, each moved a little, as surveyed shores are."""
    shore = LineString(shape.exterior)
    count = int(shore.length / step_m)
    xy = shapely.get_coordinates(shapely.line_interpolate_point(shore, np.arange(count) * shore.length / count))
    moved = Polygon(xy + rng.normal(scale=amplitude_m, size=xy.shape))
    assert moved.is_valid
    return moved


def positions(frame: Frame, xy: FloatArray) -> tuple[Position, ...]:
    degrees = np.round(frame.to_degrees(xy), DECIMALS)
    return tuple(Position(lat=lat, long=long) for long, lat in degrees.tolist())


def ring(frame: Frame, shape: Polygon) -> tuple[Position, ...]:
    return positions(frame, shapely.get_coordinates(shape.exterior)[:-1])


def on_shore(frame: Frame, shape: Polygon, x: float, y: float) -> Position:
    """The vertex of the shore that is nearest to a place."""
    xy = shapely.get_coordinates(shape.exterior)
    return positions(frame, xy[[np.argmin(np.hypot(*(xy - (x, y)).T))]])[0]


def lake() -> Mission:
    """A lake with five islands, two bays and a winding arm."""
    frame, rng = Frame(lat=46.1, long=1.9), np.random.default_rng(11)
    body = blob(0.0, 0.0, 1150.0, rng)
    arm = channel(
        [(600, 500), (1500, 900), (1700, 1700), (2600, 1500), (2900, 2300), (3700, 2300)],
        [420, 260, 200, 240, 160, 120],
    )
    west_bay = channel([(-700, 100), (-1500, 300), (-2000, -200)], [500, 320, 180])
    south_bay = channel([(200, -700), (500, -1500), (1100, -1750)], [460, 280, 200])
    shore = ragged(shapely.union_all([body, arm, west_bay, south_bay]), 32.0, 4.0, rng)
    islands = [(-300, 300, 150), (350, 250, 90), (100, -350, 210), (-560, -380, 60), (1560, 1290, 45)]
    zones = [ragged(blob(x, y, radius, rng, 0.5), 18.0, 2.0, rng) for x, y, radius in islands]
    return Mission(
        mission_type=MissionType.MAP,
        site_name="Five Islands Lake",
        launch=on_shore(frame, shore, -300.0, -1300.0),
        outline=ring(frame, shore),
        forbidden_zones=tuple(ring(frame, zone) for zone in zones),
        safety_m=10.0,
        master_speed_mps=1.5,
        master_length_m=60_000.0,
    )


def meander() -> Mission:
    """An oxbow lake: launch at one end, recovery at the other, a bathing place closed off at the shore."""
    frame, rng = Frame(lat=44.2, long=-0.4), np.random.default_rng(5)
    bend = [(-900, 900), (-1100, 200), (-800, -600), (0, -950), (800, -600), (1100, 200), (900, 900)]
    shore = ragged(channel(bend, [120, 180, 240, 260, 230, 190, 140]), 20.0, 1.5, rng)
    bathing = Point(60.0, -1000.0).buffer(70.0, quad_segs=4)
    return Mission(
        mission_type=MissionType.ADAP,
        site_name="Old Meander",
        launch=on_shore(frame, shore, -900.0, 1000.0),
        recovery=on_shore(frame, shore, 900.0, 1000.0),
        outline=ring(frame, shore),
        forbidden_zones=(ring(frame, bathing),),
        bloom=Bloom(sensor="Phycocyanin", value=30.0),
        safety_m=5.0,
        master_length_m=15_000.0,
        minimal_spatial_rate_m=10.0,
    )


def fleet() -> Mission:
    """The lake, shared among three boats: two from the landing stage, a slower one from the arm's end."""
    frame, water = Frame(lat=46.1, long=1.9), lake()
    boats = (
        GivenVehicle(name="heron", role=Role.MASTER, length_m=30_000.0),
        GivenVehicle(name="grebe", role=Role.MASTER, length_m=30_000.0),
        GivenVehicle(
            name="coot",
            role=Role.MASTER,
            speed_mps=1.0,
            length_m=20_000.0,
            start=positions(frame, np.array([[3600.0, 2300.0]]))[0],
            recovery=positions(frame, np.array([[3600.0, 2300.0]]))[0],
        ),
    )
    return msgspec.structs.replace(water, vehicles=boats)


def treat() -> Mission:
    """The meander, with three blooms to treat and a place that a swimmer reported, by two boats; a danger zone."""
    frame, rng = Frame(lat=44.2, long=-0.4), np.random.default_rng(7)
    places = [(-1060, 150, 45, 34.0), (-30, -900, 50, 41.0), (620, -720, 40, 55.0)]
    blooms = [
        PriorFeature(geometry=in_degrees(frame, blob(x, y, radius, rng, 0.3).simplify(2.0)), value=value)
        for x, y, radius, value in places
    ]
    seen = PriorFeature(geometry=in_degrees(frame, Point(1010.0, 350.0)), value=38.0)
    trees = Point(-560.0, -560.0).buffer(80.0, quad_segs=4)
    boats = (
        GivenVehicle(name="tern", role=Role.SLAVE, length_m=5_000.0),
        GivenVehicle(name="gull", role=Role.SLAVE, speed_mps=0.8, length_m=9_000.0),
    )
    return msgspec.structs.replace(
        meander(),
        mission_type=MissionType.TREAT,
        recovery=None,
        minimal_spatial_rate_m=None,
        swath_m=10.0,
        danger_zones=(GivenDangerZone(name="sunken trees", contour=ring(frame, trees), danger=0.1),),
        vehicles=boats,
        prior_model=PriorModel(features=(*blooms, seen)),
    )


def in_degrees(frame: Frame, shape: BaseGeometry) -> BaseGeometry:
    return shapely.transform(shape, lambda xy: np.round(frame.to_degrees(xy), DECIMALS))


def reservoir() -> bytes:
    """A reservoir in a branched valley, with one island, as GeoJSON."""
    frame, rng = Frame(lat=43.6, long=2.75), np.random.default_rng(3)
    valley = channel([(0, 0), (500, 700), (300, 1500), (900, 2300), (800, 3200)], [520, 600, 380, 220, 90])
    east = channel([(500, 700), (1300, 900), (1900, 1400)], [380, 220, 80])
    west = channel([(350, 1400), (-400, 1700), (-800, 2300)], [300, 180, 70])
    shore = ragged(shapely.union_all([valley, east, west]), 30.0, 3.0, rng)
    island = ragged(blob(430.0, 700.0, 70.0, rng, 0.5), 15.0, 1.5, rng)
    rings = [[[p.long, p.lat] for p in ring(frame, shape)] for shape in (shore, island)]
    feature = {
        "type": "Feature",
        "properties": {"name": "Three Valleys Reservoir"},
        "geometry": {"type": "Polygon", "coordinates": [[*points, points[0]] for points in rings]},
    }
    return msgspec.json.format(msgspec.json.encode(feature), indent=1) + b"\n"


def reservoir_prior() -> bytes:
    """Where a bloom is expected in the reservoir, inside two contours, and how it varies: a prior model."""
    frame, rng = Frame(lat=43.6, long=2.75), np.random.default_rng(11)
    outer, inner = blob(1000.0, 800.0, 380.0, rng, 0.2), blob(1050.0, 820.0, 180.0, rng, 0.2)
    prior = PriorModel(
        features=tuple(
            PriorFeature(
                geometry=in_degrees(frame, shape.simplify(5.0)),
                weight=weight,
                value=value,
            )
            for shape, weight, value in ((outer, 2.0, 10.0), (inner, 4.0, 30.0))
        ),
        variogram=Variogram(model=VariogramModel.EXPONENTIAL, range_m=300.0, sill=80.0, nugget=4.0),
    )
    return msgspec.json.format(msgspec.json.encode(prior_document(prior)), indent=1) + b"\n"


def main() -> None:
    write_mission(FOLDER / "lake.json", lake())
    write_mission(FOLDER / "meander.json", meander())
    write_mission(FOLDER / "fleet.json", fleet())
    write_mission(FOLDER / "treat.json", treat())
    (FOLDER / "reservoir.geojson").write_bytes(reservoir())
    (FOLDER / "reservoir-prior.geojson").write_bytes(reservoir_prior())


if __name__ == "__main__":
    main()
