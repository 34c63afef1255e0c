"""Pictures of missions, planned and not."""

from pathlib import Path
from xml.etree import ElementTree

import matplotlib.image
import pytest

from oxbow.errors import InvalidMission
from oxbow.mission import read_mission
from oxbow.pipeline import plan_mission
from oxbow_cli.local import local_call
from oxbow_cli.picture import draw

SITE = read_mission(Path(__file__).parents[2] / "docs/examples/meander.json")


@pytest.fixture(scope="module")
def planned():
    return plan_mission(SITE, call=local_call())


def test_a_png_of_the_width_asked_for(planned, tmp_path):
    draw(planned, tmp_path / "plan.png", width_px=600)
    pixels = matplotlib.image.imread(tmp_path / "plan.png")
    assert pixels.shape[1] == 600
    assert len({tuple(pixel) for pixel in pixels[::7, ::7, :3].reshape(-1, 3).round(2).tolist()}) > 20


def test_an_svg_names_the_site_and_the_figures(planned, tmp_path):
    draw(planned, tmp_path / "plan.svg")
    ElementTree.parse(tmp_path / "plan.svg")
    assert planned.site_name in (tmp_path / "plan.svg").read_text()


def test_the_site_alone_is_drawn_without_a_path(tmp_path):
    draw(SITE, tmp_path / "site.svg")
    assert "no path yet" in (tmp_path / "site.svg").read_text()


@pytest.mark.parametrize("name", ["plan.jpg", "plan"])
def test_another_format_is_refused(planned, tmp_path, name):
    with pytest.raises(InvalidMission, match=r"\.png or \.svg"):
        draw(planned, tmp_path / name)
    assert not list(tmp_path.iterdir())
