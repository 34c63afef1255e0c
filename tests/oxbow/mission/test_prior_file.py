"""Prior models from files: GeoJSON, ASCII grids and GeoTIFFs; what they hold, and what is wrong with them."""

import json
import sys

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from shapely import MultiPolygon, box

from oxbow.errors import InvalidMission, InvalidOption
from oxbow.mission.prior_file import read_prior
from oxbow.mission.raster import MAX_CELLS, Raster

HEADER = "ncols 3\nnrows 2\nxllcorner 1.0\nyllcorner 46.0\ncellsize 0.01\nNODATA_value -1\n"
GRID = HEADER + "1 2 2\n-1 2 2\n"
COLLECTION = '{"type": "FeatureCollection", "crs": null, "features": []}'


@pytest.fixture
def written(tmp_path):
    def write(text, name="prior.asc"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def cells(*bounds):
    return MultiPolygon([box(*bounds)])


def by_weight(prior):
    return {feature.weight: feature.geometry for feature in prior.features}


def test_a_geojson_file_is_read_as_the_mission_files_field(written):
    document = {
        "type": "FeatureCollection",
        "variogram": {"model": "spherical", "range_m": 100.0, "sill": 2.0},
        "features": [
            {
                "type": "Feature",
                "geometry": json.loads(shapely.to_geojson(box(0, 0, 1, 1))),
                "properties": {"weight": 2},
            }
        ],
    }
    prior = read_prior(written(json.dumps(document), "prior.geojson"))
    assert by_weight(prior) == {2.0: box(0, 0, 1, 1)}
    assert prior.variogram.range_m == 100.0


@pytest.mark.parametrize(
    ("changes", "west", "south"),
    [
        ({}, 1.0, 46.0),
        ({"xllcorner": "XLLCENTER", "yllcorner": "yllcenter"}, 0.995, 45.995),
        ({"NODATA_value -1\n": "", "-1 2 2": "-9999 2 2"}, 1.0, 46.0),
        ({"\n": "\r\n", "-1 2 2": "NaN 2.0 2e0"}, 1.0, 46.0),
    ],
)
def test_cells_of_a_grid_are_united_by_weight(written, changes, west, south):
    text = GRID
    for old, new in changes.items():
        text = text.replace(old, new)
    shapes = by_weight(read_prior(written(text)))
    assert shapes.keys() == {1.0, 2.0}
    assert shapes[1.0].equals_exact(cells(west, south + 0.01, west + 0.01, south + 0.02), 1e-9, normalize=True)
    assert shapes[2.0].equals_exact(cells(west + 0.01, south, west + 0.03, south + 0.02), 1e-9, normalize=True)


@pytest.mark.parametrize(
    ("old", "new", "where", "says"),
    [
        ("ncols 3", "ncols 0", "", "0 cells"),
        ("ncols 3", "ncols x", "ncols", "'x'"),
        ("nrows 2\n", "", "nrows", "missing"),
        ("cellsize 0.01", "cellsize -1", "cellsize", "-1"),
        ("xllcorner 1.0\n", "", "xllcorner", "missing"),
        ("yllcorner 46.0", "yllcorner north", "yllcorner", "north"),
        ("yllcorner 46.0", "yllcorner 5100000", "", "projected"),
        ("ncols 3\nnrows 2", "ncols 3000\nnrows 2000", "", str(MAX_CELLS)),
        ("1 2 2", "1 2", "", "4 values"),
        ("1 2 2", "1 two 2", "", "two"),
        ("1 2 2", "1 2 -3", "row 0, column 2", "-3"),
        ("1 2 2", "1 2 inf", "row 0, column 2", "inf"),
        ("1 2 2\n-1 2 2", "-1 -1 -1 -1 -1 -1", "", "no cell"),
        (HEADER, "", "ncols", "missing"),
        (GRID, "", "ncols", "missing"),
        (GRID, "ncols", "ncols", "missing"),
    ],
)
def test_a_wrong_grid_is_refused_with_its_name(written, old, new, where, says):
    path = written(GRID.replace(old, new))
    with pytest.raises(InvalidMission) as caught:
        read_prior(path)
    assert caught.value.where.startswith(str(path))
    assert caught.value.where.endswith(where)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("prior.geojson", "not json", "JSON"),
        ("prior.json", '{"type": "Feature"}', "FeatureCollection"),
        ("prior.geojson", '{"type": "FeatureCollection", "features": [3]}', r"features\[0\]"),
        ("prior.shp", "", "geojson"),
        ("prior.asc", "\x00\x01", "ncols"),
    ],
)
def test_other_files_are_refused_with_their_name(written, name, text, says):
    with pytest.raises(InvalidMission, match=says) as caught:
        read_prior(written(text, name))
    assert name in caught.value.where


@pytest.mark.parametrize(("text", "name"), [(GRID, "prior.asc"), (COLLECTION, "prior.json")])
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_is_skipped(written, text, name, encoding):
    plain = read_prior(written(text, name))
    path = written("", name)
    path.write_text(text, encoding=encoding)
    assert read_prior(path) == plain


def test_a_missing_file_is_refused_with_its_name(tmp_path):
    with pytest.raises(InvalidOption, match="cannot be read"):
        read_prior(tmp_path / "prior.asc")


def grid(weights):
    return Raster("grid", np.asarray(weights, dtype=float), west=1.0, north=46.1, step_long=0.01, step_lat=-0.02)


cell_weights = arrays.arrays(
    float, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.sampled_from([np.nan, 0.0, 1.0, 2.0])
)


@settings(max_examples=60)
@given(cell_weights.filter(lambda weights: not np.isnan(weights).all()))
def test_every_cell_lies_in_the_polygon_of_its_weight_and_in_no_other(weights):
    features = grid(weights).features()
    rows, columns = np.indices(weights.shape)
    centres = shapely.points(1.005 + 0.01 * columns, 46.09 - 0.02 * rows)
    found = np.full(weights.shape, np.nan)
    for feature in features:
        inside = shapely.contains(feature.geometry, centres)
        assert np.isnan(found[inside]).all()
        found[inside] = feature.weight
    assert np.array_equal(found, weights, equal_nan=True)
    assert sum(feature.geometry.area for feature in features) == pytest.approx(2e-4 * (~np.isnan(weights)).sum())


def test_weights_are_rounded_to_three_digits_so_that_like_cells_unite():
    (feature,) = grid([[1.2341, 1.2349], [1.23, 1.2299]]).features()
    assert feature.weight == 1.23
    assert shapely.get_num_coordinates(feature.geometry) == 5


def test_a_raster_of_many_single_cells_is_united():
    board = np.indices((100, 100)).sum(axis=0) % 2
    black, white = grid(board).features()
    assert len(black.geometry.geoms) == len(white.geometry.geoms) == 5_000


class TestGeoTiff:
    @pytest.fixture
    def tiff(self, tmp_path):
        import rasterio

        def write(weights, crs="EPSG:4326", shear=0.0, bands=1):
            path = tmp_path / "prior.tif"
            array = np.asarray(weights, dtype=np.float32)
            profile = {"driver": "GTiff", "count": bands, "dtype": "float32", "nodata": -1, "crs": crs}
            turn = rasterio.Affine(0.01, shear, 1.0, 0.0, -0.01, 46.02)
            with rasterio.open(
                path, "w", height=len(array), width=array.shape[1], transform=turn, **profile
            ) as file:
                for band in range(1, bands + 1):
                    file.write(array, band)
            return path

        return write

    def test_holds_what_the_same_ascii_grid_does(self, tiff, written):
        assert read_prior(tiff([[1, 2, 2], [-1, 2, 2]])) == read_prior(written(GRID))

    @pytest.mark.parametrize(
        ("changes", "says"),
        [
            ({"crs": "EPSG:32631"}, "EPSG:32631"),
            ({"crs": None}, "no coordinate system"),
            ({"bands": 2}, "2 bands"),
            ({"shear": 0.001}, "rotated"),
            ({"weights": [[1, -5]]}, "row 0, column 1"),
            ({"weights": [[-1, -1]]}, "no cell"),
            ({"weights": np.ones((501, 500))}, "250000"),
        ],
    )
    def test_another_is_refused_with_its_name(self, tiff, changes, says):
        path = tiff(**{"weights": [[1, 2]]} | changes)
        with pytest.raises(InvalidMission, match=says) as caught:
            read_prior(path)
        assert str(path) in caught.value.where

    def test_what_is_no_tiff_is_refused(self, written):
        with pytest.raises(InvalidMission, match="GeoTIFF"):
            read_prior(written("nonsense", "prior.tif"))


def test_without_rasterio_the_error_says_how_to_get_it(written, monkeypatch):
    monkeypatch.setitem(sys.modules, "rasterio", None)
    with pytest.raises(InvalidMission, match=r"oxbow\[raster\]"):
        read_prior(written("", "prior.tif"))
