"""The kriging variance: by hand, against the whole system of equations, and what must hold of any design."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist
from shapely import LineString, box

from oxbow.contracts import CertifyRequest, Variogram, VariogramModel
from oxbow_certificate.certify import certify
from oxbow_certificate.cover import least_radius
from oxbow_certificate.kriging import (
    NEAREST,
    SPREAD,
    correlation,
    kriging_variance,
    local_variance,
    sample_positions,
    sampling_pitch,
)
from oxbow_certificate.spread import even_places

SQUARE = box(0, 0, 100, 100)
quick = settings(max_examples=25)
models = st.sampled_from(VariogramModel)


def variogram(model=VariogramModel.EXPONENTIAL, range_m=50.0, sill=1.0, nugget=0.0):
    return Variogram(model=model, range_m=range_m, sill=sill, nugget=nugget)


def whole_system(samples, places, model):
    """The ordinary kriging variance from all samples: one bordered system, with a Lagrange multiplier."""
    count = len(samples)
    bordered = np.ones((count + 1, count + 1))
    bordered[:count, :count] = correlation(model, cdist(samples, samples))
    bordered[range(count), range(count)] = 1.0
    bordered[count, count] = 0.0
    right = np.ones((count + 1, len(places)))
    right[:count] = correlation(model, cdist(samples, places))
    solution = np.linalg.solve(bordered, right)
    return 1.0 - (solution * right).sum(axis=0)


@pytest.mark.parametrize("model", VariogramModel)
def test_correlation_falls_from_one_to_a_twentieth_at_the_range(model):
    at = correlation(variogram(model), np.array([0.0, 25.0, 50.0, 100.0]))
    assert at[0] == pytest.approx(1.0)
    assert (np.diff(at) <= 0).all()
    assert at[2] == pytest.approx(0.0 if model is VariogramModel.SPHERICAL else 0.05, abs=1e-8)


def test_one_sample_tells_the_mean_and_no_more_from_afar():
    # The error of the value found elsewhere: two independent fields' difference.
    far = local_variance(np.array([[0.0, 0.0]]), np.array([[1e6, 0.0]]), variogram())
    assert far == pytest.approx([2.0])


def test_two_samples_by_hand():
    model = variogram(sill=4.0, nugget=1.0)
    between, to_each = correlation(model, np.array([20.0, 10.0]))
    # By symmetry both weights are 1/2: C(0) - 2 c + (C(0) + C(h)) / 2.
    found = local_variance(np.array([[0.0, 0.0], [20.0, 0.0]]), np.array([[10.0, 0.0]]), model)
    assert found == pytest.approx([1.0 - 2.0 * to_each + (1.0 + between) / 2.0])


@quick
@given(models, st.floats(1.0, 1e3), st.floats(0.0, 0.9), st.integers(1, NEAREST), st.integers(0, 2**16))
def test_few_samples_are_solved_exactly(model, range_m, nugget, count, seed):
    draw = np.random.default_rng(seed)
    samples, places = draw.uniform(0, 100, (count, 2)), draw.uniform(0, 100, (7, 2))
    known = variogram(model, range_m, nugget=nugget)
    found = local_variance(samples, places, known)
    assert found == pytest.approx(whole_system(samples, places, known), abs=1e-5)


@quick
@given(models, st.floats(5.0, 300.0), st.floats(0.0, 0.9), st.integers(0, 2**16))
def test_a_few_of_many_samples_never_underrate_and_overrate_little(model, range_m, nugget, seed):
    draw = np.random.default_rng(seed)
    samples, places = draw.uniform(0, 100, (300, 2)), draw.uniform(0, 100, (50, 2))
    known = variogram(model, range_m, nugget=nugget)
    found, whole = local_variance(samples, places, known), whole_system(samples, places, known)
    assert (found > whole - 1e-6).all()
    assert found.mean() < whole.mean() + 0.05


@quick
@given(models, st.floats(10.0, 500.0), st.integers(NEAREST + SPREAD, 200))
def test_a_sample_that_is_both_near_and_spread_counts_once(model, range_m, count):
    samples = np.column_stack([np.linspace(0, 100, count), np.zeros(count)])
    known = variogram(model, range_m, nugget=0.5)
    place = np.array([[50.0, 1.0]])
    assert local_variance(samples, place, known) >= whole_system(samples, place, known) - 1e-9


@pytest.mark.parametrize("model", VariogramModel)
def test_a_smooth_field_sampled_densely_and_twice_stays_within_zero_and_one(model):
    path = LineString([(0, y) if (y // 2 + x) % 2 else (100, y) for y in range(0, 100, 2) for x in (0, 1)])
    there_and_back = LineString([*path.coords, *path.coords[::-1]])
    found = local_variance(
        sample_positions(there_and_back, 1.0), even_places(SQUARE, 500), variogram(model, 1000.0)
    )
    assert (found >= -1e-12).all()
    assert found.max() < 0.05


@quick
@given(models, st.floats(1.0, 200.0), st.floats(0.5, 1e4))
def test_scale_makes_no_difference(model, range_m, scale):
    path = LineString([(10, 10), (90, 10), (90, 40), (10, 40), (10, 90)])
    places = even_places(SQUARE, 200)
    small = kriging_variance(path, places, variogram(model, range_m), 20.0)
    large = kriging_variance(
        LineString(np.array(path.coords) * scale), places * scale, variogram(model, range_m * scale), 20.0 * scale
    )
    assert large.mean == pytest.approx(small.mean, abs=1e-5)
    assert large.max == pytest.approx(small.max, abs=1e-5)


def test_samples_lie_on_the_path_evenly_from_end_to_end():
    path = LineString([(0, 0), (10, 0), (10, 0), (10, 5)])
    samples = sample_positions(path, 4.0)
    assert samples.tolist() == [[0, 0], [3.75, 0], [7.5, 0], [10, 1.25], [10, 5]]
    assert len(sample_positions(path, 100.0)) == 2


def test_the_pitch_follows_range_and_spacing_and_is_bounded():
    path = LineString([(0, 0), (1e6, 0)])
    assert sampling_pitch(variogram(range_m=500.0), path, 200.0) == 50.0
    assert sampling_pitch(variogram(range_m=5e4), path, 200.0) == 200.0
    assert sampling_pitch(variogram(range_m=1.0), path, 200.0) == 5.0


def rows(spacing):
    ys = np.arange(spacing / 2, 100, spacing)
    return LineString([(x, y) for i, y in enumerate(ys) for x in ((2, 98) if i % 2 == 0 else (98, 2))])


def judged(path, known):
    return kriging_variance(path, even_places(SQUARE, 2_000), known, least_radius(SQUARE.area, path.length))


def test_closer_rows_tell_more_and_a_crowd_in_one_corner_less():
    known = variogram(range_m=40.0, sill=9.0)
    coarse, fine = judged(rows(25.0), known), judged(rows(10.0), known)
    crowded = LineString(np.array(rows(10.0).coords) * (1.0, 0.4))
    assert 0 < fine.mean < coarse.mean < coarse.max < 1
    assert judged(crowded, known).mean > fine.mean


def test_the_nugget_is_the_least_that_is_left():
    found = judged(rows(5.0), variogram(VariogramModel.GAUSSIAN, range_m=500.0, sill=2.0, nugget=0.5))
    assert 0.25 < found.mean < found.max < 0.35


def test_nothing_is_left_untold_of_a_field_that_does_not_vary():
    assert judged(rows(25.0), variogram(range_m=1e9)).max == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("known", [None, variogram(range_m=40.0)])
def test_a_certificate_has_it_where_there_is_a_variogram(known):
    path = rows(25.0)
    request = CertifyRequest(
        outline=SQUARE, path=path, launch=path.coords[0], recovery=path.coords[-1], variogram=known
    )
    found = certify(request)
    if known is None:
        assert found.kriging_variance_mean is found.kriging_variance_max is None
    else:
        assert found.kriging_variance_mean == pytest.approx(judged(path, known).mean, rel=0.01)
        assert found.kriging_variance_max == pytest.approx(judged(path, known).max, rel=0.05)
