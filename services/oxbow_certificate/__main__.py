"""Serves the stage `certificate` on the bus."""

from oxbow.contracts import CERTIFY
from oxbow.stage import serve_stage

if __name__ == "__main__":
    serve_stage(CERTIFY, "oxbow_certificate.service:handle")
