"""UsdPreviewSurface materials as closures of the ABI, and what stands in for a missing one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..scene import Scene
from ._pxr import Sdf, Usd, UsdShade
from .binding import Bindings
from .color_space import check_color_space
from .inputs import Inputs, is_node
from .report import Report
from .texture import COLOR_READERS, Rgba, Textures

#: A parameter of the ABI: a number, a colour or a texture's output.
Value = Any

#: Shaders whose inputs are those of UsdPreviewSurface.
PREVIEW_SURFACES = ("UsdPreviewSurface", "ND_UsdPreviewSurface_surfaceshader")

#: UsdPreviewSurface's own default, also for what has no material.
GREY = 0.18

#: Keys of the closures that scatter light, which all take a normal map.
Closure = dict[str, Any]


@dataclass(frozen=True)
class Surface:
    """A material before it is added to the scene.

    Attributes:
        name: path of the material, for messages.
        closure: how it scatters.
        opacity: presence: below 1 light passes straight through.
        emission: its glow; None if it does not glow.
        primvars: names of the mesh attributes its textures read.
        displacement: how far it moves the mesh, as the ABI writes it; None if it does not.
    """

    name: str
    closure: Closure
    opacity: Value
    emission: Value | None
    primvars: frozenset[str]
    displacement: dict[str, Any] | None = None

    def json(self, strength: Value) -> dict[str, Any]:
        """The ABI's description, the glow multiplied by the strength."""
        result: dict[str, Any] = {"surface": with_emission(self.closure, self.emission, strength)}
        if self.opacity != 1:
            result["opacity"] = self.opacity
        if self.displacement is not None:
            result["displacement"] = self.displacement
        return result


def with_emission(closure: Closure, emission: Value | None, strength: Value) -> Closure:
    """A closure that also glows, with radiance emission x strength."""
    if emission is None:
        return closure
    glow = {"type": "emission", "color": emission, "strength": strength}
    if is_black(closure):
        return glow
    return {"type": "add", "a": closure, "b": glow}


def is_black(closure: Closure) -> bool:
    """Whether a closure scatters nothing."""
    return closure["type"] == "diffuse" and is_constant(closure["color"], 0)


def is_constant(v: Value, number: float) -> bool:
    """Whether a value is that number in every channel."""
    if isinstance(v, dict):
        return False
    return all(c == number for c in v) if isinstance(v, (list, tuple)) else v == number


class _Node:
    """Reads the inputs of one UsdPreviewSurface node and remembers the primvars they need."""

    def __init__(
        self, node: UsdShade.Shader, textures: Textures, inputs: Inputs, *, moves: bool = False
    ) -> None:
        """`moves`: whether the material's displacement is this node's."""
        self.node = node
        self._moves = moves
        self.primvars: set[str] = set()
        self._textures = textures
        self._inputs = inputs
        self._report = inputs.report

    def constant(self, name: str, default: Any) -> Any:
        """An input that cannot be textured."""
        return self._inputs.value(self.node, name, default)

    def threshold(self) -> float:
        """The value of opacity from which the surface is there; 0: no such limit."""
        return self._inputs.floats(self.node, "opacityThreshold", (0.0,))[0]

    def number(self, name: str, default: float) -> Value:
        """A number, possibly a texture's channel."""
        return self._value(name, default, "r")

    def color(self, name: str, default: float) -> Value:
        """A colour, possibly a texture's."""
        return self._value(name, default, "rgb")

    def is_authored(self, name: str) -> bool:
        """Whether anything was said of an input."""
        found = self.node.GetInput(name)
        return bool(found) and (found.GetAttr().HasAuthoredValue() or found.HasConnectedSource())

    def is_textured(self, name: str) -> bool:
        """Whether an input is fed by a node."""
        return is_node(self._inputs.source(self.node, name))

    def mask(self, name: str, threshold: float) -> Value:
        """1 where the input reaches the threshold, else 0."""
        found = self._inputs.source(self.node, name)
        if not is_node(found):
            number = self._inputs.floats(self.node, name, (1.0,))[0]
            return 1.0 if number >= threshold else 0.0
        node, output = found
        if node.GetIdAttr().Get() != "UsdUVTexture":
            self._report.unsupported(
                self.node.GetPrim(), "opacityThreshold without a UsdUVTexture", "it is left away"
            )
            return self.number(name, 1.0)
        read = self._textures.uv_texture(node, threshold=threshold, channel=output)
        if isinstance(read, Rgba):
            return 1.0 if read.channel(output) >= threshold else 0.0
        self.primvars.add(read.coordinates.primvar)
        return {"texture": read.id, "channel": "r"}

    @cached_property
    def height(self) -> Value:
        """How far the surface moves along its normal, in its own space."""
        return self.number("displacement", 0.0) if self._moves else 0.0

    def displacement(self) -> dict[str, Any] | None:
        """What moves the mesh, as the key of a material."""
        height = self.height
        if is_constant(height, 0):
            return None
        bumpy = "height" in (self.normal or {})
        return {"height": height, "space": "object", "keeps_normals": bumpy}

    @cached_property
    def normal(self) -> dict[str, Any] | None:
        """The normal map, as the key that scattering closures take.

        Without one a textured displacement is also seen where the mesh is too coarse to show it.
        """
        found = self._inputs.source(self.node, "normal")
        if not is_node(found):
            height = self.height
            return {"height": height, "space": "object"} if isinstance(height, dict) else None
        node, output = found
        kind = node.GetIdAttr().Get()
        if kind != "UsdUVTexture" or output != "rgb":
            self._report.unsupported(
                self.node.GetPrim(), f"a normal from '{kind}' ({output})", "it is ignored"
            )
            return None
        read = self._textures.uv_texture(node, normal_map=True)
        if isinstance(read, Rgba):
            return None
        self.primvars.add(read.coordinates.primvar)
        return {"texture": read.id, "uv": read.coordinates.primvar}

    def _value(self, name: str, default: float, plain: str) -> Value:
        found = self._inputs.source(self.node, name)
        if found is None:
            return default
        if not is_node(found):
            if plain == "r":
                return self._inputs.checked(self.node, name, found, (default,))[0]
            numbers = self._inputs.checked(self.node, name, found, (default,) * 3)
            return numbers[0] if numbers[0] == numbers[1] == numbers[2] else numbers
        node, output = found
        kind = node.GetIdAttr().Get()
        if kind == "UsdUVTexture":
            return self._from_image(node, output, plain)
        if kind in COLOR_READERS:
            read = self._textures.attribute(node)
            if read is not None:
                texture, primvar = read
                self.primvars.add(primvar)
                return {"texture": texture, "channel": plain}
        self._report.unsupported(
            self.node.GetPrim(), f"the node '{kind}' on {name}", f"{default} is used"
        )
        return default

    def _from_image(self, node: UsdShade.Shader, output: str, plain: str) -> Value:
        read = self._textures.uv_texture(node)
        channel = output if output in ("r", "g", "b", "a") else plain
        if isinstance(read, Rgba):
            return list(read[:3]) if channel == "rgb" else read.channel(channel)
        if channel == "a" and not read.has_alpha:
            return 1.0
        self.primvars.add(read.coordinates.primvar)
        return {"texture": read.id, "channel": channel}


def read_surface(material: UsdShade.Material, textures: Textures, inputs: Inputs) -> Surface | None:
    """A material's surface, or None, with an entry in the report, if it has none we can draw."""
    prim, report = material.GetPrim(), inputs.report
    node = material.ComputeSurfaceSource()[0]
    kind = node.GetIdAttr().Get() if node else None
    if kind not in PREVIEW_SURFACES:
        node, other = _other_context(material)
        if node is None:
            found = kind or other
            what = f"the surface '{found}'" if found else "a material without a surface"
            report.unsupported(prim, what, "displayColor or grey 0.18 is used")
            return None
    volume = material.GetVolumeOutput()
    if volume and volume.HasConnectedSource():
        report.unsupported(prim, "a volume", "it is ignored")
    moving = material.ComputeDisplacementSource()[0]
    if moving and moving.GetPrim() != node.GetPrim():
        report.unsupported(prim, "displacement by another node", "it is ignored")
    check_color_space(node.GetPrim(), report)
    moves = bool(moving) and moving.GetPrim() == node.GetPrim()
    return _surface(_Node(node, textures, inputs, moves=moves), report)


def _other_context(material: UsdShade.Material) -> tuple[UsdShade.Shader | None, str]:
    """A node like UsdPreviewSurface on another render context's output, and what else is there."""
    kinds = []
    for output in material.GetSurfaceOutputs():
        context = output.GetBaseName().rpartition(":")[0]
        node = material.ComputeSurfaceSource(context)[0] if context else None
        kind = node.GetIdAttr().Get() if node else None
        if kind in PREVIEW_SURFACES:
            return node, kind
        if context:
            kinds.append(str(kind or context))
    return None, ", ".join(kinds)


def _surface(inputs: _Node, report: Report) -> Surface:
    opaque = _opaque_closure(inputs)
    emission = inputs.color("emissiveColor", 0.0)
    displacement = inputs.displacement()
    threshold = inputs.threshold()
    mode = str(inputs.constant("opacityMode", "transparent"))
    presence: Value = 1
    closure = opaque
    if threshold > 0:
        presence = inputs.mask("opacity", threshold)
    elif inputs.is_textured("opacity") and not inputs.is_authored("opacityMode"):
        # By the letter this is glass of varying tint; files that leave the mode unsaid and paint
        # the opacity mean leaves and labels.
        presence = inputs.number("opacity", 1.0)
        if not is_constant(presence, 1):
            report.note(
                inputs.node.GetPrim(),
                "a textured opacity without an opacityMode",
                "it cuts the surface out, as opacityMode = presence does",
            )
    elif mode == "presence":
        presence = inputs.number("opacity", 1.0)
    else:
        opacity = inputs.number("opacity", 1.0)
        if not is_constant(opacity, 1):
            clear = _clear_closure(inputs)
            closure = (
                clear
                if is_constant(opacity, 0)
                else {"type": "mix", "factor": opacity, "a": clear, "b": opaque}
            )
    return Surface(
        str(inputs.node.GetPrim().GetPath()),
        closure,
        presence,
        None if is_constant(emission, 0) else emission,
        frozenset(inputs.primvars),
        displacement,
    )


def _opaque_closure(inputs: _Node) -> Closure:
    """The simplest closure that says what the node says at opacity 1."""
    base = inputs.color("diffuseColor", GREY)
    roughness = inputs.number("roughness", 0.5)
    ior = inputs.number("ior", 1.5)
    coat = inputs.number("clearcoat", 0.0)
    specular_workflow = bool(inputs.constant("useSpecularWorkflow", 0))
    specular = inputs.color("specularColor", 0.0) if specular_workflow else None
    metallic = 0.0 if specular_workflow else inputs.number("metallic", 0.0)
    normal = inputs.normal
    common = {} if normal is None else {"normal": normal}
    if is_constant(coat, 0):
        # ior 1 reflects nothing, unless the specular workflow gives its own reflectance.
        if (
            is_constant(ior, 1)
            and is_constant(metallic, 0)
            and (specular is None or is_constant(specular, 0))
        ):
            return {"type": "diffuse", "color": base, **common}
        if is_constant(metallic, 1):
            return {"type": "glossy", "color": base, "roughness": roughness, **common}
    closure = {
        "type": "principled",
        "base_color": base,
        "metallic": metallic,
        "roughness": roughness,
        "ior": ior,
        "metal_f90": "base",
        **common,
    }
    if specular is not None:
        closure["specular_color"] = specular
    if not is_constant(coat, 0):
        closure["coat"] = coat
        closure["coat_roughness"] = inputs.number("clearcoatRoughness", 0.01)
    return closure


def _clear_closure(inputs: _Node) -> Closure:
    """What is behind the diffuse part where opacity is 0: a clear dielectric of the node's ior.

    UsdPreviewSurface's opacity takes away the diffuse part only, so what is left is untinted.
    """
    ior = inputs.number("ior", 1.5)
    if is_constant(ior, 1):
        return {"type": "transparent", "color": 1}
    normal = inputs.normal
    return {
        "type": "glass",
        "color": 1,
        "roughness": inputs.number("roughness", 0.5),
        "ior": ior,
        **({} if normal is None else {"normal": normal}),
    }


class Materials:
    """Adds each material once for each use of it."""

    def __init__(self, scene: Scene, textures: Textures, inputs: Inputs) -> None:
        self._scene = scene
        self._textures = textures
        self._inputs = inputs
        self._surfaces: dict[Sdf.Path, Surface | None] = {}
        self._display: dict[str, int] = {}
        self._ids: dict[str, int] = {}
        self._bindings = Bindings(inputs.report)

    def bound_surface(self, prim: Usd.Prim) -> Surface | None:
        """The surface bound to a prim: directly, by collection, or inherited.

        The binding for full renders counts; where that has no surface that we can draw, the one
        for previews.
        """
        self._bindings.check(prim)
        binding = UsdShade.MaterialBindingAPI(prim)
        for purpose in (UsdShade.Tokens.full, UsdShade.Tokens.preview):
            material, _ = binding.ComputeBoundMaterial(purpose)
            surface = self.surface(material) if material else None
            if surface is not None:
                return surface
        return None

    def surface(self, material: UsdShade.Material) -> Surface | None:
        """A material's surface, read once."""
        path = material.GetPath()
        if path not in self._surfaces:
            self._surfaces[path] = read_surface(material, self._textures, self._inputs)
        return self._surfaces[path]

    def display(self, color: Value | None, opacity: Value | None) -> Surface:
        """What stands in for a material: displayColor and displayOpacity.

        Args:
            color: their constant values,
            opacity: or None where they vary over the mesh.
        """
        primvars = set()
        if color is None:
            color = {"texture": self._display_texture("displayColor", GREY), "channel": "rgb"}
            primvars.add("displayColor")
        if opacity is None:
            opacity = {"texture": self._display_texture("displayOpacity", 1.0), "channel": "r"}
            primvars.add("displayOpacity")
        closure = {"type": "diffuse", "color": color}
        return Surface("displayColor", closure, opacity, None, frozenset(primvars))

    def _display_texture(self, primvar: str, default: float) -> int:
        if primvar not in self._display:
            texture = {"type": "attribute", "name": primvar, "default": [default] * 3 + [1.0]}
            self._display[primvar] = self._scene.add_texture(primvar, texture)
        return self._display[primvar]

    def add(self, surface: Surface, strength: Value) -> int:
        """The material's id; the same description is added once."""
        description = surface.json(strength)
        key = repr(description)
        if key not in self._ids:
            self._ids[key] = self._scene.add_material(surface.name, description)
        return self._ids[key]
