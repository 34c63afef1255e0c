"""Serves the stage `path` on the bus: ``python -m oxbow_path``."""

from oxbow.stage import serve_stage

if __name__ == "__main__":
    serve_stage("oxbow.contracts:PATH", "oxbow_path.service:handle")
