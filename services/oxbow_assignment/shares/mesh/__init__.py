"""Triangular meshes of areas, and wavefronts over them (Balampanis, Maza and Ollero 2016)."""

from oxbow_assignment.shares.mesh.generation import mesh_area
from oxbow_assignment.shares.mesh.mesh import AngleStatistics, Mesh
from oxbow_assignment.shares.mesh.wavefront import Wavefront, propagate

__all__ = ["AngleStatistics", "Mesh", "Wavefront", "mesh_area", "propagate"]
