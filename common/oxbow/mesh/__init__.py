"""Triangular meshes of areas, and wavefronts over them (Balampanis, Maza and Ollero 2016)."""

from oxbow.mesh.generation import mesh_area
from oxbow.mesh.mesh import AngleStatistics, Mesh
from oxbow.mesh.wavefront import Wavefront, propagate

__all__ = ["AngleStatistics", "Mesh", "Wavefront", "mesh_area", "propagate"]
