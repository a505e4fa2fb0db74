"""The walk over a stage: which prims are drawn, and with which transformations.

Instanceable prims and point instancers are walked once for each prototype; their instances only
multiply the transformations of what was found there, so that they stay true instances however
deeply they are nested.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._pxr import Gf, Tf, Usd, UsdGeom, UsdLux, UsdShade, reason
from .instancer import instance_transforms
from .report import Report
from .transform import column_matrix, compose, local_matrix


@dataclass(frozen=True)
class Item:
    """A drawn prim, or one in a prototype, and where it stands.

    Attributes:
        prim: the prim; inside an instance, the proxy below the first instance that is alike.
        transforms: (n, 4, 4) float64, to the space of the prototype (of the world, at the end).
        absolute: the prim resets the transformation stack, so an instance does not move it.
    """

    prim: Usd.Prim
    transforms: np.ndarray
    absolute: bool = False


@dataclass(frozen=True)
class _State:
    """What a prim inherits: transformation up to the nearest instance, and purpose."""

    matrix: Gf.Matrix4d
    absolute: bool = False
    purpose: str = "default"
    purpose_inherits: bool = False


class _Scope:
    """What is found below one root: the stage's, or a prototype's.

    Instances are collected by prototype and multiplied out when the scope is closed, all those of
    a prototype at once.
    """

    def __init__(self) -> None:
        self._items: list[Item] = []
        self._placed: dict[tuple, tuple[list[Item], list[np.ndarray]]] = {}

    def add(self, prim: Usd.Prim, state: _State) -> None:
        """A drawn prim."""
        self._items.append(Item(prim, column_matrix(state.matrix)[None], state.absolute))

    def place(self, key: Any, items: list[Item], outer: np.ndarray, absolute: bool) -> None:
        """Instances of a prototype with the given (n, 4, 4) transformations."""
        self._placed.setdefault((key, absolute), (items, []))[1].append(outer)

    def close(self) -> list[Item]:
        """All items, those of one prim together."""
        found = list(self._items)
        for (_, absolute), (items, matrices) in self._placed.items():
            outer = np.concatenate(matrices)
            for item in items:
                transforms = item.transforms if item.absolute else compose(outer, item.transforms)
                found.append(Item(item.prim, transforms, item.absolute or absolute))
        merged: dict[tuple, list[Item]] = {}
        for item in found:
            merged.setdefault((item.prim.GetPath(), item.absolute), []).append(item)
        return [
            Item(same[0].prim, np.concatenate([i.transforms for i in same]), same[0].absolute)
            for same in merged.values()
        ]


class Walker:
    """Finds the drawn prims of a stage at one time."""

    def __init__(
        self, stage: Usd.Stage, time: Usd.TimeCode, purposes: Iterable[str], report: Report
    ) -> None:
        self._stage = stage
        self._time = time
        self._purposes = frozenset(purposes)
        self._report = report
        self._prototypes: dict[tuple, list[Item]] = {}
        self._inherited: dict[Any, tuple] = {}
        self._open: list[Any] = []

    def items(self) -> list[Item]:
        """The drawn prims, each once, with all its transformations, in stage order."""
        predicate = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
        root = self._stage.GetPseudoRoot()
        return self._walk(root.GetFilteredChildren(predicate), _State(Gf.Matrix4d(1)), predicate)

    def _walk(self, roots: Iterable[Usd.Prim], state: _State, predicate: Any) -> list[Item]:
        """Everything drawn at and below the roots."""
        scope = _Scope()
        stack = [(prim, state) for prim in reversed(list(roots))]
        while stack:
            prim, inherited = stack.pop()
            own = self._own_state(prim, inherited)
            if own is None:
                continue
            self._check_type(prim)
            if prim.IsInstance():
                self._instance(prim, own, predicate, scope)
                continue
            if prim.IsA(UsdGeom.PointInstancer):
                if self._is_drawn(prim, own):
                    self._point_instancer(prim, own, scope)
                continue
            if _is_drawable(prim) and self._is_drawn(prim, own):
                scope.add(prim, own)
            children = prim.GetFilteredChildren(predicate)
            stack.extend((child, own) for child in reversed(children))
        return scope.close()

    def _check_type(self, prim: Usd.Prim) -> None:
        """Reports prims of schemas that are not installed: nothing is known of what they draw."""
        name = prim.GetTypeName()
        if name and prim.GetPrimTypeInfo().GetSchemaType().isUnknown:
            self._report.unsupported(prim, f"prims of the unknown type '{name}'", "left out")

    def _own_state(self, prim: Usd.Prim, state: _State) -> _State | None:
        """What holds at a prim and below it; None if it is invisible."""
        imageable = UsdGeom.Imageable(prim)
        if imageable:
            if imageable.GetVisibilityAttr().Get(self._time) == UsdGeom.Tokens.invisible:
                self._report.left_out(prim, "invisible")
                return None
            state = self._with_purpose(imageable, state)
        xformable = UsdGeom.Xformable(prim)
        if not xformable:
            return state
        own, reset = local_matrix(xformable, self._time, self._report)
        return _State(
            own if reset else own * state.matrix,
            reset or state.absolute,
            state.purpose,
            state.purpose_inherits,
        )

    def _with_purpose(self, imageable: UsdGeom.Imageable, state: _State) -> _State:
        """UsdGeomImageable's rule: an authored purpose holds for the prim and what is below."""
        attribute = imageable.GetPurposeAttr()
        if attribute.HasAuthoredValue():
            return _State(state.matrix, state.absolute, attribute.Get(), True)
        if not state.purpose_inherits and state.purpose != "default":
            return _State(state.matrix, state.absolute, "default", False)
        return state

    def _is_drawn(self, prim: Usd.Prim, state: _State) -> bool:
        if state.purpose in self._purposes:
            return True
        self._report.left_out(prim, f"of purpose '{state.purpose}'")
        return False

    def _instance(self, prim: Usd.Prim, state: _State, predicate: Any, scope: _Scope) -> None:
        key = (
            prim.GetPrototype().GetPath(),
            state.purpose,
            state.purpose_inherits,
            self._inherited_by(prim),
        )
        if key not in self._prototypes:
            inner = _State(Gf.Matrix4d(1), False, state.purpose, state.purpose_inherits)
            self._prototypes[key] = self._walk(
                prim.GetFilteredChildren(predicate), inner, predicate
            )
        outer = column_matrix(state.matrix)[None]
        scope.place(key, self._prototypes[key], outer, state.absolute)

    def _inherited_by(self, prim: Usd.Prim) -> tuple:
        """What the prims of an instance may inherit from above it: bindings and primvars.

        Instances for which this is the same share what was found in the first of them.
        """
        path = prim.GetPath()
        known = self._inherited.get(path)
        if known is not None:
            return known
        parent = prim.GetParent()
        above = self._inherited_by(parent) if parent and not parent.IsPseudoRoot() else ()
        own: list = []
        for relationship in prim.GetAuthoredPropertiesInNamespace("material"):
            name = relationship.GetName()
            if name.startswith("material:binding") and isinstance(relationship, Usd.Relationship):
                strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(relationship)
                targets = tuple(relationship.GetTargets())
                # A collection's members are given by path: no two instances are alike.
                mark = path if ":collection:" in name else None
                own.append((name, targets, strength, mark))
        own.extend(
            primvar.GetAttr().GetPath()
            for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues()
        )
        result = (*above, *own)
        self._inherited[path] = result
        return result

    def _point_instancer(self, prim: Usd.Prim, state: _State, scope: _Scope) -> None:
        try:
            groups = instance_transforms(UsdGeom.PointInstancer(prim), self._time, self._report)
        except Tf.ErrorException as error:
            self._report.warning(prim, reason(error), "left out")
            return
        # A prototype is drawn wherever it is defined: below an `over`, a class, or the instancer.
        predicate = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded)
        outer = column_matrix(state.matrix)[None]
        for path, transforms in groups:
            if path in self._open:
                self._report.warning(
                    prim, f"the prototype {path} holds its own instancer", "left out"
                )
                continue
            key = (path, state.purpose, state.purpose_inherits)
            if key not in self._prototypes:
                inner = _State(Gf.Matrix4d(1), False, state.purpose, state.purpose_inherits)
                self._open.append(path)
                items = self._walk([self._stage.GetPrimAtPath(path)], inner, predicate)
                self._open.pop()
                # Resetting the stack inside a prototype goes no further than the prototype.
                self._prototypes[key] = [Item(i.prim, i.transforms) for i in items]
            scope.place(key, self._prototypes[key], compose(outer, transforms), state.absolute)


def _is_drawable(prim: Usd.Prim) -> bool:
    """Whether the prim itself is geometry or a light, rather than a group, camera or material."""
    return prim.IsA(UsdGeom.Boundable) or prim.HasAPI(UsdLux.LightAPI) or is_light(prim)


def all_prims(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """All prims, hidden ones too, those of each prototype once."""
    yield from stage.Traverse()
    for prototype in stage.GetPrototypes():
        yield from Usd.PrimRange(prototype)


def is_light(prim: Usd.Prim) -> bool:
    """Whether the prim is a light by its type, rather than geometry made one by an API schema."""
    return prim.IsA(UsdLux.BoundableLightBase) or prim.IsA(UsdLux.NonboundableLightBase)
