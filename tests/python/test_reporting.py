"""Figures as people read them."""

import math

import pytest

from segue import error_text


@pytest.mark.parametrize(
    ("report", "text"),
    [
        ({}, "error -"),
        ({"estimated_error": None, "estimated_bias": None}, "error -"),
        ({"estimated_error": math.nan}, "error -"),
        ({"estimated_error": 0.0}, "error -"),
        ({"estimated_error": 4e-4, "estimated_bias": None}, "error 2 %"),
        (
            {"estimated_error": 2.81e-4, "estimated_bias": 2.5e-5},
            "error 1.7 % (noise 1.6, bias 0.5)",
        ),
        ({"estimated_error": 4e-4, "estimated_bias": 0.0}, "error 2 % (noise 2, bias 0)"),
        ({"estimated_error": 9.0}, "error 300 %"),
    ],
)
def test_errors_are_told_in_percent_with_their_parts(report, text):
    assert error_text(report) == text
