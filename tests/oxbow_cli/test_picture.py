"""Pictures of missions, planned and not."""

import json
from xml.etree import ElementTree

import matplotlib.image
import msgspec
import pytest

from oxbow.contracts import Conformance, Role
from oxbow.errors import InvalidMission, InvalidOption
from oxbow.mission.file import mission_json, parse_mission, read_mission
from oxbow.mission.plan import FleetRecord, PlanOptions, VehicleRecord
from oxbow.planning.pipeline import plan_mission
from oxbow.site.site import Site
from oxbow_cli import chart, sheet
from oxbow_cli.gaps import draw_gaps
from oxbow_cli.local import local_call
from oxbow_cli.picture import draw
from tests.support.project import EXAMPLES

SITE = read_mission(EXAMPLES / "meander.json")


@pytest.fixture(scope="module")
def planned():
    at_once = PlanOptions(time_limit_s=1e-3)  # no step of refinement: the same path on any machine
    return plan_mission(SITE, at_once, call=local_call())


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


def warm_share(file):
    """The share of pixels that say: farther than the least radius."""
    red, _, blue = matplotlib.image.imread(file)[..., :3].transpose(2, 0, 1)
    return (red > blue + 0.2).mean()


def test_the_paths_of_slaves_are_counted_with_their_length(planned, tmp_path):
    """The plan's own length is that of the masters."""
    rules = {name: getattr(planned.plan.certificate, name) for name in Conformance.__struct_fields__}
    vehicles = tuple(
        VehicleRecord(
            name=role,
            role=role,
            length_m=length_m,
            max_length_m=9e3,
            duration_s=1.0,
            certificate=Conformance(**rules),
        )
        for role, length_m in ((Role.MASTER, 4_000.0), (Role.SLAVE, 2_500.0))
    )
    fleet = FleetRecord(makespan_s=1.0, imbalance=0.0, vehicles=vehicles)
    both = msgspec.structs.replace(planned, plan=msgspec.structs.replace(planned.plan, fleet=fleet))
    draw(both, tmp_path / "both.svg")
    assert "2 paths 6.5 km" in (tmp_path / "both.svg").read_text()


def test_gaps_are_warm(planned, tmp_path):
    draw_gaps(planned, tmp_path / "whole.png", width_px=500)
    quarter = planned.master_path[: len(planned.master_path) // 4]
    to_and_fro = (quarter + quarter[::-1]) * 2
    draw_gaps(msgspec.structs.replace(planned, master_path=to_and_fro), tmp_path / "quarter.png", width_px=500)
    assert warm_share(tmp_path / "quarter.png") > 4 * warm_share(tmp_path / "whole.png")


def test_gaps_have_a_scale(planned, tmp_path):
    draw_gaps(planned, tmp_path / "gaps.svg")
    text = (tmp_path / "gaps.svg").read_text()
    assert f"in least radii of {planned.plan.certificate.least_radius_m:.3g} m" in text


def test_a_name_is_plain_text(planned, tmp_path):
    named = msgspec.structs.replace(planned, site_name=r"Lake $\frac{x$ of _1")
    for draw_it in (draw, draw_gaps):
        draw_it(named, tmp_path / "plan.svg")
        assert r"Lake $\frac{x$ of _1" in (tmp_path / "plan.svg").read_text()


def test_labels_cover_the_place_where_they_are_written():
    _, axes = sheet.new_sheet(Site.of(SITE))
    chart.note(axes, (0.0, 0.0), "a label of some length", colour="black")
    west, south, east, north = chart.labelled_area(axes).bounds
    assert 0 < west < 0.1 * (east - west), "to the right of its place"
    assert 0 < north - south < 0.2 * (east - west)


@pytest.mark.parametrize(
    "name", ["Lake", "A lake of a very long name, " * 4, "A lake without an end, " * 400, "W\n" * 99]
)
def test_a_name_keeps_off_the_arrow_to_the_north(name):
    figure, _ = sheet.new_sheet(Site.of(SITE))
    sheet.draw_header(figure, name, f"figures of {name}")
    arrow = 0.945 * figure.get_window_extent().width
    title, figures = figure.texts
    assert title.get_window_extent().x1 < arrow
    assert figures.get_window_extent().x1 < arrow
    assert title.get_text().startswith(name[:1])
    assert (title.get_text() == "Lake") is (name == "Lake")
    assert "\n" not in title.get_text()


def test_characters_that_no_font_has_are_said_in_one_line(tmp_path, caplog):
    named = msgspec.structs.replace(SITE, site_name="Lake \U0001f6a4\U0001f6a5 \U000f0000")
    draw(named, tmp_path / "plan.png", width_px=300)
    (record,) = caplog.records
    assert "no installed font has" in record.getMessage()
    assert "\U000f0000" in record.getMessage()


def test_gaps_need_a_path(tmp_path):
    with pytest.raises(InvalidMission, match="oxbow plan"):
        draw_gaps(SITE, tmp_path / "gaps.png")


def test_a_plan_of_an_earlier_version_is_still_read(planned, tmp_path):
    document = json.loads(mission_json(planned))
    for name in ("p99_distance_m", "p99_ratio", "least_leg_distance_m", "discrepancy", "discrepancy_ratio"):
        del document["Plan"]["certificate"][name]
    earlier = parse_mission(json.dumps(document).encode())
    assert earlier.plan.certificate.p99_ratio is None
    assert earlier.plan.certificate.q == planned.plan.certificate.q
    draw(earlier, tmp_path / "plan.png", width_px=300)


@pytest.mark.parametrize("name", ["plan.jpg", "plan"])
def test_another_format_is_refused(planned, tmp_path, name):
    with pytest.raises(InvalidOption, match=r"\.png or \.svg"):
        draw(planned, tmp_path / name)
    assert not list(tmp_path.iterdir())
