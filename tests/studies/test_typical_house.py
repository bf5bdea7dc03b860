"""The house of the study: the most typical one by its tours."""

import numpy as np
import pytest

from studies.examples.typical_house import OBJECTS, rms_z_scores, tour_lengths


def test_the_mean_house_is_the_most_typical_and_units_do_not_matter():
    lengths = np.random.default_rng(0).uniform(50.0, 150.0, (40, len(OBJECTS)))
    lengths[7] = np.delete(lengths, 7, axis=0).mean(axis=0)
    assert rms_z_scores(lengths).argmin() == 7
    assert rms_z_scores(lengths) == pytest.approx(rms_z_scores(lengths * [1.0, 2.0, 3.0, 0.1]))
    assert rms_z_scores(lengths)[7] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
def test_more_objects_make_longer_tours():
    lengths = tour_lengths(2)
    assert lengths.shape == (2, 4) and np.all(np.diff(lengths, axis=1) > 0)
