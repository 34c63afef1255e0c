"""Serves the stage `assignment` on the bus: ``python -m oxbow_assignment``."""

from oxbow.stage import serve_stage

if __name__ == "__main__":
    serve_stage("oxbow.contracts:ASSIGN", "oxbow_assignment.service:handle")
