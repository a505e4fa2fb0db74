"""Functions of several textures: as sums of products, or as tables, whichever holds them.

A texture is one picture, one noise or one attribute. What nodes make of several is found by trying
the function out: most mixes are linear in each of their inputs, and what is not is tabulated where
it works on each component alone. What is linear in some input is split there, and its halves are
tried in turn.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .arithmetic import array, products
from .values import (
    Baked,
    Composed,
    Constant,
    Kind,
    UnsupportedError,
    Value,
    bounds,
    component,
)

# Inputs that a texture may be made of.
_MOST = 3
# Entries for each unit along tables of one value, and at most; along each side of those of two, and
# of the components of a colour.
_ROW, _LONGEST_ROW = 1024, 16384
_SQUARE, _CUBE = 256, 33
# Spans over which squares and cubes are fine enough.
_WIDEST_SQUARE, _WIDEST_CUBE = 4.0, 2.0
# Points at which a function is compared with what is to stand for it, and the share of them where a
# table may be off by more than a fiftieth of what it spans: beside steps.
_PROBES = 2048
_OFF = 0.02
_HUGE = 1e30

Function = Callable[..., np.ndarray]


@dataclass(frozen=True)
class _Problem:
    """A function of some values, none of which is constant."""

    name: str
    kind: Kind
    function: Function
    of: tuple[Value, ...]

    def __call__(self, *inputs: np.ndarray) -> np.ndarray:
        """The function of rows (points, 3) of inputs, as such rows."""
        rows = [
            row[None, :, :1] if value.kind == "float" else row[None]
            for row, value in zip(inputs, self.of, strict=True)
        ]
        with np.errstate(all="ignore"):
            found = np.nan_to_num(self.function(*rows), nan=0.0, posinf=0.0, neginf=0.0)
        found = np.broadcast_to(np.asarray(found, np.float64), (1, len(inputs[0]), found.shape[-1]))
        return np.broadcast_to(found[0], (len(inputs[0]), 3))

    @cached_property
    def domain(self) -> list[tuple[float, float]]:
        """Of each input, at least from 0 to 1."""
        found = [bounds(value) for value in self.of]
        return [(min(low, 0.0), max(high, 1.0)) for low, high in found]

    @cached_property
    def probes(self) -> list[np.ndarray]:
        """Points all over the domain, the same every time."""
        numbers = np.random.default_rng(1)
        rows = [low + (high - low) * numbers.random((_PROBES, 3)) for low, high in self.domain]
        return [
            row if value.channel == "rgb" else np.repeat(row[:, :1], 3, axis=1)
            for row, value in zip(rows, self.of, strict=True)
        ]

    @cached_property
    def found(self) -> np.ndarray:
        """What the function is there."""
        return self(*self.probes)


def _alike(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.allclose(a, b, rtol=1e-4, atol=1e-5 * max(1.0, float(np.abs(b).max()))))


def compose(name: str, kind: Kind, function: Function, *values: Value) -> Value:
    """`function` of values that no single picture holds."""
    arrays = [array(value) if isinstance(value, Constant) else None for value in values]
    of = tuple(value for value in values if not isinstance(value, Constant))

    def of_the_others(*inputs: np.ndarray) -> np.ndarray:
        rest = iter(inputs)
        return function(*(next(rest) if fixed is None else fixed for fixed in arrays))

    return _composed(_Problem(name, kind, of_the_others, of))


def _composed(problem: _Problem) -> Value:
    if len(problem.of) > _MOST:
        raise UnsupportedError(f"arithmetic on {len(problem.of)} textures at once")
    for attempt in (_multilinear, _table, _split):
        found = attempt(problem)
        if found is not None:
            return found
    raise UnsupportedError("arithmetic of this kind on several textures")


def _multilinear(problem: _Problem) -> Value | None:
    count = len(problem.of)
    subsets = range(1 << count)
    ends = [np.array([[float(subset >> i & 1)] * 3 for subset in subsets]) for i in range(count)]
    coefficients = problem(*ends).copy()
    # From the values at the corners to the factors of products: differences along each input.
    for i in range(count):
        for subset in subsets:
            if subset >> i & 1:
                coefficients[subset] -= coefficients[subset ^ (1 << i)]
    sums = sum(c * p for c, p in zip(coefficients, products(problem.probes), strict=True))
    if not _alike(problem.found, np.asarray(sums)):
        return None
    at = np.meshgrid(*map(bounds, problem.of), indexing="ij")
    corners = problem(*(np.repeat(side.reshape(-1, 1), 3, axis=1) for side in at))
    reach = (float(corners.min()), float(corners.max()))
    return Composed(
        problem.name, problem.of, problem.kind, _channel(problem), reach, coefficients=coefficients
    )


def _channel(problem: _Problem) -> str:
    return "r" if problem.kind == "float" else "rgb"


def _table(problem: _Problem) -> Value | None:
    of, domain = problem.of, problem.domain
    if len(of) > 2:
        return None
    probes, found = problem.probes, problem.found
    alone = np.stack(
        [problem(*(np.repeat(row[:, [c]], 3, axis=1) for row in probes))[:, c] for c in range(3)],
        axis=-1,
    )
    widest = max(high - low for low, high in domain)
    if _alike(alone, found):
        if len(of) == 2 and widest > _WIDEST_SQUARE:
            return None
        side = _SQUARE if len(of) == 2 else int(min(_ROW * widest, _LONGEST_ROW))
        picture = _tabulated(problem, side)
    elif len(of) == 1 and of[0].channel == "rgb" and widest <= _WIDEST_CUBE:
        # Colours that become others as a whole: a table of their three components.
        along = np.linspace(*domain[0], _CUBE)
        blue, green, red = np.meshgrid(along, along, along, indexing="ij")
        values = problem(np.stack([red.ravel(), green.ravel(), blue.ravel()], axis=-1))
        picture = values.reshape(_CUBE * _CUBE, _CUBE, 3)
        of = tuple(component(of[0], index) for index in range(3))
        domain = domain * 3
        probes = [np.repeat(probes[0][:, [index]], 3, axis=1) for index in range(3)]
    else:
        return None
    reach = (float(picture.min()), float(picture.max()))
    if max(-reach[0], reach[1], widest) > _HUGE or not _is_close(picture, domain, probes, found):
        return None
    table = Baked(problem.name, picture.astype(np.float32))
    return Composed(
        problem.name, of, problem.kind, _channel(problem), reach, table=table, domain=tuple(domain)
    )


def _is_close(
    picture: np.ndarray,
    domain: list[tuple[float, float]],
    probes: list[np.ndarray],
    found: np.ndarray,
) -> bool:
    """Whether a table, linear between its entries, is the function at nearly all probes."""
    width = picture.shape[1]
    rows = picture.shape[0] if len(domain) < 3 else width
    sides, places = [width, rows, width][: len(domain)], []
    for row, (low, high), side in zip(probes, domain, sides, strict=True):
        places.append((row - low) / (high - low) * (side - 1))
    told = np.zeros_like(found)
    for corner in itertools.product((0, 1), repeat=len(domain)):
        weight, entry = np.ones_like(found), np.zeros(found.shape, int)
        for i, (place, side) in enumerate(zip(places, sides, strict=True)):
            lower = np.clip(place.astype(int), 0, side - 2)
            share = place - lower
            weight *= share if corner[i] else 1.0 - share
            entry += (lower + corner[i]) * (1, width, width * rows)[i]
        told += weight * picture.reshape(-1, 3)[entry, [0, 1, 2]]
    span = max(float(found.max() - found.min()), 1e-6)
    return bool((np.abs(told - found) > _OFF * span).mean() <= _OFF)


def _tabulated(problem: _Problem, side: int) -> np.ndarray:
    """A table of a function of one or two values, of the means around its entries.

    Of the entries alone, steps where both values are equal would be half an entry aside.
    """
    step = 1.0 / (side - 1)
    along = np.linspace(0.0, 1.0, side)
    around = [np.clip(along + by * step, 0.0, 1.0) for by in (-0.25, 0.25)]
    found = []
    for sides in itertools.product(around, repeat=len(problem.of)):
        scaled = [
            low + (high - low) * side
            for side, (low, high) in zip(sides, problem.domain, strict=True)
        ]
        at = np.meshgrid(*scaled, indexing="xy")
        found.append(problem(*(np.repeat(row.reshape(-1, 1), 3, axis=1) for row in at)))
    return np.mean(found, axis=0).reshape(-1, side, 3)


def _split(problem: _Problem) -> Value | None:
    """Between what the function is at 0 and at 1 of an input in which it is linear."""
    if len(problem.of) < 2:
        return None
    probes, found = problem.probes, problem.found
    for i, value in enumerate(problem.of):

        def at(end: float, i: int = i) -> np.ndarray:
            rows = [np.full_like(row, end) if k == i else row for k, row in enumerate(probes)]
            return problem(*rows)

        low, high = at(0.0), at(1.0)
        if not _alike(low + (high - low) * probes[i], found):
            continue
        try:
            halves = [_composed(_without(problem, i, end)) for end in (0.0, 1.0)]
        except UnsupportedError:
            continue
        between = _Problem(
            problem.name, problem.kind, lambda t, a, b: a + (b - a) * t, (value, *halves)
        )
        return _multilinear(between)
    return None


def _without(problem: _Problem, index: int, end: float) -> _Problem:
    """The same with one input fixed."""
    width = 1 if problem.of[index].kind == "float" else 3

    def function(*inputs: np.ndarray) -> np.ndarray:
        fixed = np.full((1, 1, width), end)
        return problem.function(*inputs[:index], fixed, *inputs[index:])

    rest = (*problem.of[:index], *problem.of[index + 1 :])
    return _Problem(problem.name, problem.kind, function, rest)
