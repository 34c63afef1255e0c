"""Where the project's files are, and what tests read of them."""

import json
from pathlib import Path
from typing import Any

__all__ = ["DOCS", "EXAMPLES", "ROOT", "SCHEMA"]

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
EXAMPLES = DOCS / "examples"
SCHEMA: dict[str, Any] = json.loads((DOCS / "mission-file.schema.json").read_text())
"""The schema of Mission Files."""
