"""What pyproject.toml lists twice, since no tool reads it from folders, is what there is."""

import re
import tomllib

from tests.support.project import ROOT

IMPORT_RULES = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
PACKAGES = {file.parent.name for place in ("common", "services") for file in ROOT.glob(f"{place}/*/__init__.py")}


def test_every_package_is_under_the_import_rules():
    assert set(IMPORT_RULES["root_packages"]) == PACKAGES


def test_every_package_has_its_layer():
    [layers] = [rule["layers"] for rule in IMPORT_RULES["contracts"] if "containers" not in rule]
    assert set(re.split(r"\W+", " ".join(layers))) == PACKAGES


def test_tests_mirror_the_packages():
    """Folders of tests that are no kinds of their own are packages that there are."""
    kinds = {"bench", "contract", "docs", "golden", "support"}
    for file in (ROOT / "tests").glob("**/test_*.py"):
        folder = file.parent.relative_to(ROOT / "tests")
        if folder.parts and folder.parts[0] not in kinds:
            assert any((ROOT / place / folder).is_dir() for place in ("common", "services")), file
