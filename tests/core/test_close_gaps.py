"""Gaps that rays cannot tell from contacts are named where they would hold light."""

import pytest
from rooms import by_rays

from pdm_core import Plane, Scene, Surface


@pytest.mark.parametrize("gap, named", [(0.0, False), (1e-13, False), (1e-9, True), (1e-8, True), (1e-4, False)])
def test_surfaces_that_shine_at_each_other_through_a_gap_that_is_taken_as_none(gap, named):
    floor, sheet = Plane((0, 0, 0), (4, 0, 0), (0, 4, 0)), Plane((1, 1, gap), (2, 0, 0), (0, 2, 0))
    surfaces = [
        Surface(floor, 0.5, 0.5, name="floor"),
        Surface(sheet, 0.5, name="above"),
        Surface(sheet, 0.5, 0.5, side="back", name="below"),
    ]
    said = [text for text in by_rays(Scene(surfaces)).warnings if "taken as in contact" in text]
    assert len(said) == named and all("'below' and 'floor'" in text for text in said)


def test_what_does_not_shine_there_is_not_named():
    floor, sheet = Plane((0, 0, 0), (4, 0, 0), (0, 4, 0)), Plane((1, 1, 1e-9), (2, 0, 0), (0, 2, 0))
    surfaces = [Surface(floor, 0.5), Surface(sheet, 0.5), Surface(sheet, 0.5, side="back")]
    assert by_rays(Scene(surfaces, 1.0)).warnings == []
