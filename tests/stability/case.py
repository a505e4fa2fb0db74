"""What a case of the stability suite is, and when it passes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from stage import Means


@dataclass(frozen=True)
class Row:
    """One measured value beside the right one."""

    parameter: str
    expected: float
    got: float
    #: Standard errors of `got` and of `expected` together.
    error: float
    #: Relative deviation that is allowed beside chance.
    tolerance: float
    #: Samples that were not finite, in the film or in single segments.
    refused: int = 0
    #: For plots: the parameter as a number, and the line it belongs to.
    at: float | None = None
    line: str = ""
    #: Whether `expected` is a bound that `got` must stay below.
    is_bound: bool = False

    @property
    def off(self) -> float:
        """Relative deviation."""
        scale = abs(self.expected)
        return (self.got - self.expected) / scale if scale > 0 else self.got

    @property
    def noise(self) -> float:
        """Relative standard error."""
        scale = abs(self.expected)
        return self.error / scale if scale > 0 else self.error

    @property
    def is_right(self) -> bool:
        """Below the bound; or within the tolerance and three standard errors.

        One standard error may be half the tolerance at most.
        """
        if self.is_bound:
            return self.refused == 0 and self.got < self.expected
        sound = math.isfinite(self.got) and self.noise <= max(self.tolerance / 2, 1e-12)
        return sound and self.refused == 0 and abs(self.off) <= self.tolerance + 3 * self.noise


Rows = Iterator[Row]


@dataclass(frozen=True)
class Case:
    """A case: `run(full)` measures its rows, fewer of them unless `full`."""

    group: str
    name: str
    #: Where the right value comes from.
    answer: str
    run: Callable[[bool], Rows]
    #: What `Row.at` is, in plots.
    axis: str = ""


CASES: list[Case] = []


def case(
    group: str, answer: str, axis: str = ""
) -> Callable[[Callable[[bool], Rows]], Callable[[bool], Rows]]:
    """Registers a case; its name is the function's documentation."""

    def register(run: Callable[[bool], Rows]) -> Callable[[bool], Rows]:
        name = (run.__doc__ or run.__name__).strip().rstrip(".")
        CASES.append(Case(group, name, answer, run, axis))
        return run

    return register


def row(
    parameter: str,
    expected: float,
    got: Means,
    tolerance: float,
    at: float | None = None,
    line: str = "",
) -> Row:
    """A row whose right value is exact."""
    return Row(parameter, expected, got.mean, got.error, tolerance, got.refused, at, line)


def beside(parameter: str, reference: Means, got: Means, tolerance: float) -> Row:
    """A row whose right value is another measurement with seeds of its own."""
    error = math.hypot(reference.error, got.error)
    refused = got.refused + reference.refused
    return Row(parameter, reference.mean, got.mean, error, tolerance, refused)


def exact(
    parameter: str, expected: float, got: float, tolerance: float = 0.0, refused: int = 0
) -> Row:
    """A row without noise."""
    return Row(parameter, expected, got, 0.0, tolerance, refused)


def below(
    parameter: str,
    bound: float,
    got: float,
    refused: int = 0,
    at: float | None = None,
    line: str = "",
) -> Row:
    """A row whose value must stay below a bound."""
    return Row(parameter, bound, got, 0.0, 0.0, refused, at, line, True)
