"""A prior model from a file: GeoJSON, or a raster of weights as ESRI ASCII grid or GeoTIFF."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from oxbow.arrays import FloatArray
from oxbow.contracts import MAX_REQUEST_BYTES
from oxbow.errors import InvalidMission
from oxbow.mission.files import read_bytes
from oxbow.mission.prior import PriorModel, parse_prior
from oxbow.mission.raster import Raster, require_size
from oxbow.wire.strict_json import utf8

__all__ = ["read_prior"]

WGS84_EPSG = 4326
ESRI_NO_DATA = -9999.0
_CORNERS = frozenset({"xllcorner", "xllcenter", "yllcorner", "yllcenter"})
_HEADER = frozenset({"ncols", "nrows", "cellsize", "nodata_value"}) | _CORNERS


def read_prior(path: Path) -> PriorModel:
    """The prior model in a file.

    Parameters
    ----------
    path
        A GeoJSON FeatureCollection (.geojson, .json) as in a Mission File's `PriorModel`, or a raster whose cells
        are weights, in WGS84 degrees: an ESRI ASCII grid (.asc) or a GeoTIFF (.tif, .tiff; needs rasterio).

    Raises
    ------
    InvalidMission
        The file cannot be read or holds something else; the error names the file, and what in it.
    """
    match path.suffix.lower():
        case ".geojson" | ".json":
            return parse_prior(read_bytes(path, MAX_REQUEST_BYTES), str(path))
        case ".asc":
            return PriorModel(features=_ascii_grid(path).features())
        case ".tif" | ".tiff":
            return PriorModel(features=_geotiff(path).features())
        case _:
            raise InvalidMission(
                "is of an unknown kind; expected .geojson, .json, .asc, .tif or .tiff", where=str(path)
            )


def _ascii_grid(path: Path) -> Raster:
    """Read an ESRI ASCII grid: a header of names and numbers, then rows of values from north to south."""
    name = str(path)
    # Undecodable bytes become replacement characters, which are then refused as numbers, with their text.
    words = utf8(read_bytes(path, MAX_REQUEST_BYTES), name).decode("utf-8", "replace").split()
    begin = 0
    # The header has no fixed number of lines: it ends at the first word that is none of its names.
    while begin < len(words) and words[begin].lower() in _HEADER:
        begin += 2
    header = _Header(name, dict(zip(map(str.lower, words[:begin:2]), words[1:begin:2], strict=False)))
    columns, rows, cell = header.count("ncols"), header.count("nrows"), header.number("cellsize")
    if cell <= 0:
        raise InvalidMission(f"is {cell!r}; expected degrees > 0", where=f"{name}: cellsize")
    require_size(name, rows, columns)
    weights = _cells(name, words[begin:], rows, columns)
    weights[weights == header.number("nodata_value", ESRI_NO_DATA)] = np.nan
    west, south = header.corner("x", cell), header.corner("y", cell)
    return Raster(name, weights, west=west, north=south + rows * cell, step_long=cell, step_lat=-cell)


@dataclass(frozen=True)
class _Header:
    """The header of an ASCII grid, its fields' names in small letters."""

    name: str
    words: Mapping[str, str]

    def number(self, field: str, default: float | None = None) -> float:
        text = self.words.get(field)
        if text is None and default is not None:
            return default
        try:
            return float(text or "")
        except ValueError as error:
            raise self._error(field, "a number") from error

    def count(self, field: str) -> int:
        if not self.words.get(field, "").isdecimal():
            raise self._error(field, "a whole number > 0")
        return int(self.words[field])

    def corner(self, axis: str, cell: float) -> float:
        """Where the lower left cell's outer corner lies; the header gives that, or the cell's centre."""
        centre = f"{axis}llcenter"
        return self.number(centre) - cell / 2 if centre in self.words else self.number(f"{axis}llcorner")

    def _error(self, field: str, accepted: str) -> InvalidMission:
        found = f"is {self.words[field]!r}" if field in self.words else "is missing"
        return InvalidMission(f"{found}; expected {accepted}", where=f"{self.name}: {field}")


def _cells(name: str, words: list[str], rows: int, columns: int) -> FloatArray:
    try:
        values = np.array(words, dtype=np.float64)
    except ValueError as error:
        raise InvalidMission(f"is not a grid of numbers: {error}", where=name) from error
    if len(values) != rows * columns:
        raise InvalidMission(f"has {len(values)} values; expected nrows x ncols, {rows} x {columns}", where=name)
    return values.reshape(rows, columns)


def _geotiff(path: Path) -> Raster:
    """Read a GeoTIFF of one band, north up."""
    name = str(path)
    try:
        import rasterio  # noqa: PLC0415 - an optional package
    except ImportError as error:
        raise InvalidMission("needs the package rasterio: pip install 'oxbow[raster]'", where=name) from error
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        try:
            with rasterio.open(path) as dataset:
                return _raster(name, dataset)
        except rasterio.errors.RasterioError as error:
            raise InvalidMission(f"cannot be read as a GeoTIFF: {error}", where=name) from error


def _raster(name: str, dataset: Any) -> Raster:
    """The only band of an open rasterio dataset."""
    # From the file's header, before `read` allocates what a forged one asks for.
    require_size(name, dataset.height, dataset.width)
    if dataset.count != 1:
        raise InvalidMission(f"has {dataset.count} bands; expected one, of weights", where=name)
    if dataset.crs is None or dataset.crs.to_epsg() != WGS84_EPSG:
        system = "no coordinate system" if dataset.crs is None else f"the system {dataset.crs.to_string()}"
        raise InvalidMission(f"has {system}; expected WGS84 degrees, EPSG:{WGS84_EPSG}", where=name)
    to_degrees = dataset.transform
    if to_degrees.b or to_degrees.d:
        raise InvalidMission("is rotated; expected rows from west to east", where=name)
    weights = dataset.read(1, masked=True).astype(np.float64).filled(np.nan)
    return Raster(
        name, weights, west=to_degrees.c, north=to_degrees.f, step_long=to_degrees.a, step_lat=to_degrees.e
    )
