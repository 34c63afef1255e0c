"""Serves the stage `decomposition` on the bus: ``python -m oxbow_decomposition``."""

from oxbow.stage import serve_stage

if __name__ == "__main__":
    serve_stage("oxbow.contracts:DECOMPOSE", "oxbow_decomposition.service:handle")
