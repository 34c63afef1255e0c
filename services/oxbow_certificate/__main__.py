"""Serves the stage `certificate` on the bus."""

from oxbow.stage import serve_stage

from oxbow.contracts import CERTIFY

if __name__ == "__main__":
    serve_stage(CERTIFY, "oxbow_certificate.service:handle")
