"""The decomposition stage as a process: ``python -m oxbow_decomposition``."""

from oxbow.contracts import DECOMPOSE
from oxbow.stage import serve_stage

if __name__ == "__main__":
    serve_stage(DECOMPOSE, "oxbow_decomposition.service:handle")
