"""Evaluation of value sockets: what number, colour or image arrives at an input."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from ..export.object_info import ObjectInfo
from ..log import ExportLog
from .arithmetic import average, combine
from .composition import compose
from .coordinates import AS_IT_IS
from .textures import TextureStore
from .tree import Source, Stack, resolve, socket
from .value_nodes import VALUE_NODES
from .values import (
    KINDS,
    Constant,
    ImageValue,
    Kind,
    Sampling,
    UnsupportedError,
    Value,
    convert,
)

# What stands in for an output that Segue cannot compute: (node, output identifier) -> value. The
# numbers are the means of the patterns over space, or what a typical surface point would have.
_STAND_INS: dict[tuple[str, str], tuple[float, ...]] = {
    ("ShaderNodeNewGeometry", "Backfacing"): (0.0,),
    ("ShaderNodeNewGeometry", "Parametric"): (0.5,),
    ("ShaderNodeLightPath", "Is Camera Ray"): (1.0,),
    ("ShaderNodeLightPath", "Is Shadow Ray"): (0.0,),
    ("ShaderNodeLightPath", "Is Diffuse Ray"): (0.0,),
    ("ShaderNodeLightPath", "Is Glossy Ray"): (0.0,),
    ("ShaderNodeLightPath", "Is Singular Ray"): (0.0,),
    ("ShaderNodeLightPath", "Is Reflection Ray"): (0.0,),
    ("ShaderNodeLightPath", "Is Transmission Ray"): (0.0,),
    ("ShaderNodeLightPath", "Ray Depth"): (0.0,),
    ("ShaderNodeLightPath", "Diffuse Depth"): (0.0,),
    ("ShaderNodeLightPath", "Glossy Depth"): (0.0,),
    ("ShaderNodeLightPath", "Transparent Depth"): (0.0,),
    ("ShaderNodeLightPath", "Transmission Depth"): (0.0,),
    ("ShaderNodeWireframe", "Fac"): (0.0,),
}


class Evaluator:
    """Evaluates one node tree. `owner` names its material, world or light in warnings."""

    def __init__(
        self,
        owner: str,
        textures: TextureStore,
        log: ExportLog,
        *,
        world: bool = False,
        camera: bool | None = None,
        info: ObjectInfo | None = None,
    ) -> None:
        """`camera`: whether it is for rays from the camera, where these are told from others.

        `info`: what is known of the object.
        """
        self.owner = owner
        self.textures = textures
        self.log = log
        self.world = world
        self.camera = camera
        self.info = info
        #: Whether the direction counts that a surface is seen from.
        self.view = False
        #: Whether a value depends on the camera, and on the object.
        self.tells_camera = False
        self.tells_object = False
        #: What is said where a pattern of a world is simplified: it may yet become a picture.
        self.simplified: list[str] = []
        self._memo: dict[tuple, Value] = {}

    def warn(self, node: bpy.types.Node, what: str, instead: str) -> None:
        """Say that `what` of a node is not supported and what is used `instead`."""
        self.log.warn(self._text(node, what, instead))

    def simplify(self, node: bpy.types.Node, what: str, instead: str) -> None:
        """The same of a pattern."""
        if self.world:
            self.simplified.append(self._text(node, what, instead))
        else:
            self.warn(node, what, instead)

    def _text(self, node: bpy.types.Node, what: str, instead: str) -> str:
        label = "" if node.bl_label in node.name else f" ({node.bl_label})"
        return f"{self.owner}: node '{node.name}'{label}: {what} is not supported, {instead}"

    def value(self, entry: bpy.types.NodeSocket, stack: Stack) -> Value:
        """The value at an input, of the input's kind."""
        source = resolve(entry, stack)
        if source.node is not None:
            value = self._output(source)
        elif source.socket is not None:
            value = self._default(source.socket)
        else:
            value = Constant.number(0.0)
        if isinstance(value, Constant) and not np.isfinite(value.rgb).all():
            self.warn(entry.node, f"a number that is not finite at '{entry.name}'", "0 is used")
            value = Constant((0.0, 0.0, 0.0), value.kind)
        for kind in source.kinds:
            if kind in KINDS:
                value = convert(value, KINDS[kind])
        return value

    def combine(
        self, node: bpy.types.Node, kind: Kind, function: Callable[..., np.ndarray], *values: Value
    ) -> Value:
        """Apply `function` to values, or to their averages where that cannot be expressed."""
        attempts = [combine, compose]
        if self.world:
            # What surrounds a scene is one picture.
            attempts = [combine]
        elif self.tells_object and not all(isinstance(value, Constant) for value in values):
            # One picture for each object would be too much.
            attempts = [compose, combine]
        problem = ""
        for attempt in attempts:
            try:
                return attempt(node.name, kind, function, *values)
            except UnsupportedError as reason:
                problem = str(reason)
        self.simplify(node, problem, "averages are used")
        return combine(node.name, kind, function, *(average(value) for value in values))

    def number(self, entry: bpy.types.NodeSocket, stack: Stack) -> float:
        """An input that must be a plain number: an image is replaced by its mean."""
        return convert(self.constant(entry, stack), "float").rgb[0]

    def constant(self, entry: bpy.types.NodeSocket, stack: Stack) -> Constant:
        """An input that must be the same everywhere: an image is replaced by its mean."""
        value = self.value(entry, stack)
        if isinstance(value, Constant):
            return value
        self.simplify(entry.node, f"a texture at '{entry.name}'", "its average is used")
        return average(value)

    @staticmethod
    def _default(entry: bpy.types.NodeSocket) -> Constant:
        kind = KINDS.get(entry.type)
        if kind is None:
            return Constant.number(0.0)
        if kind == "float":
            return Constant.number(entry.default_value)
        return (
            Constant.color(entry.default_value)
            if kind == "color"
            else Constant.vector(entry.default_value)
        )

    def _output(self, source: Source) -> Value:
        if source.key not in self._memo:
            self._memo[source.key] = self._compute(source.node, source.output, source.stack)
        return self._memo[source.key]

    def _compute(self, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
        handler = VALUE_NODES.get(node.bl_idname)
        try:
            if handler is None:
                raise UnsupportedError(f"the output '{output.name}'")
            return handler(self, node, output, stack)
        except UnsupportedError as reason:
            stand_in = self._stand_in(node, output, stack)
            rounded = ", ".join(
                f"{number:.3g}" for number in stand_in.rgb[: 1 if stand_in.kind == "float" else 3]
            )
            is_pattern = (node.bl_idname, output.identifier) not in _STAND_INS
            tell = self.simplify if is_pattern else self.warn
            tell(node, str(reason), f"{rounded} is used")
            return stand_in

    def _stand_in(
        self, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
    ) -> Constant:
        """The plainest value that could come from a node: a mean of what it mixes."""
        kind = KINDS.get(output.type, "float")
        known = _STAND_INS.get((node.bl_idname, output.identifier))
        if known is not None:
            return Constant.number(known[0]) if kind == "float" else Constant.color(known)
        if node.bl_idname == "ShaderNodeFresnel":
            ior = self.number(node.inputs["IOR"], stack)
            return Constant.number(((ior - 1.0) / (ior + 1.0)) ** 2 if ior > 0 else 0.0)
        if (
            node.bl_idname in {"ShaderNodeTexImage", "ShaderNodeTexEnvironment"}
            and node.image is not None
        ):
            straight = output.identifier == "Alpha"
            source = self.textures.source(node.image, node.image_user, straight)
            channel = "a" if output.identifier == "Alpha" else "rgb"
            return average(ImageValue(source, Sampling("uv", AS_IT_IS), kind, channel))
        colors = [entry for entry in node.inputs if entry.type == "RGBA" and entry.enabled]
        if kind != "float" and colors:
            mean = np.mean([average(self.value(entry, stack)).rgb for entry in colors], axis=0)
            return Constant.color(mean) if kind == "color" else Constant.vector(mean)
        if kind == "float":
            return Constant.number(0.5)
        return Constant.color((0.5,) * 3) if kind == "color" else Constant.vector((0.0,) * 3)

    def inputs(self, node: bpy.types.Node, stack: Stack, *identifiers: str) -> list[Value]:
        """Values of several inputs."""
        return [self.value(socket(node, identifier), stack) for identifier in identifiers]
