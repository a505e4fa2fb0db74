"""The ctypes declarations against the C header, as a C compiler sees it."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess

import pytest

from conftest import ROOT
from segue import _abi

HEADER = ROOT / "cpp_bridge" / "include" / "segue.h"
STRUCTURES = {
    "segue_attribute": _abi.CAttribute,
    "segue_mesh": _abi.CMesh,
    "segue_image": _abi.CImage,
    "segue_instances": _abi.CInstances,
    "segue_callbacks": _abi.CCallbacks,
}


@pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler")
def test_structures_and_enums(tmp_path):
    lines = ["#include <stdio.h>", f'#include "{HEADER}"', "int main(void) {"]
    expected = []
    for name, structure in STRUCTURES.items():
        lines.append(f'printf("%zu\\n", sizeof({name}));')
        expected.append(ctypes.sizeof(structure))
        for field, _ in structure._fields_:
            lines.append(f'printf("%zu\\n", offsetof({name}, {field}));')
            lines.append(f'printf("%zu\\n", sizeof((({name} *)0)->{field}));')
            member = getattr(structure, field)
            expected += [member.offset, member.size]
    for name, value in (
        ("SEGUE_ABI_VERSION", _abi.ABI_VERSION),
        *((f"SEGUE_{k.upper()}", v) for k, v in _abi.INTERPOLATIONS.items()),
        ("SEGUE_U8", _abi.PIXEL_TYPES["uint8"]),
        ("SEGUE_U16", _abi.PIXEL_TYPES["uint16"]),
        ("SEGUE_F16", _abi.PIXEL_TYPES["float16"]),
        ("SEGUE_F32", _abi.PIXEL_TYPES["float32"]),
    ):
        lines.append(f'printf("%zu\\n", (size_t){name});')
        expected.append(value)
    source = tmp_path / "layout.c"
    source.write_text("\n".join([*lines, "return 0; }"]))
    subprocess.run(["cc", "-o", tmp_path / "layout", source], check=True)
    output = subprocess.run([tmp_path / "layout"], check=True, capture_output=True, text=True)
    assert [int(v) for v in output.stdout.split()] == expected


def test_every_function_is_declared_with_as_many_arguments():
    text = re.sub(r"/\*.*?\*/", "", HEADER.read_text(), flags=re.S)
    found = {}
    for name, arguments in re.findall(r"SEGUE_API[^;]*?(segue_\w+)\(([^;]*)\);", text):
        found[name] = 0 if arguments.strip() == "void" else arguments.count(",") + 1
    assert found == {name: len(a) for name, (_, a) in _abi.PROTOTYPES.items()}


def test_every_status_has_its_exception():
    from segue import errors

    text = HEADER.read_text()
    statuses = {int(v): n for n, v in re.findall(r"SEGUE_(\w+) = (\d+)[,\s]", text) if n.isupper()}
    block = text[text.index("typedef enum segue_status") : text.index("} segue_status")]
    codes = {int(v) for v in re.findall(r"= (\d+)", block)} - {0}
    assert statuses
    assert {type(errors.from_status(c, "x")).status for c in codes} == codes
