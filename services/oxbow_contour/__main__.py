"""Serves the stage `contour` on the bus: ``python -m oxbow_contour``."""

from oxbow.stage import serve_stage

if __name__ == "__main__":
    serve_stage("oxbow.contracts:CONTOUR", "oxbow_contour.service:handle")
