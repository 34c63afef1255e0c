"""Serves the stage `certificate` on the bus: ``python -m oxbow_certificate``."""

from oxbow.stage import serve_stage

if __name__ == "__main__":
    serve_stage("oxbow.contracts:CERTIFY", "oxbow_certificate.service:handle")
