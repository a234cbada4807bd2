"""The package itself: the stubs are of what is compiled, docstrings' examples hold, nothing is imported that is not needed."""

import ast
import doctest
import pathlib
import subprocess
import sys

import v2x
from v2x import _v2x, arrays, engine, lab

PACKAGE = pathlib.Path(v2x.__file__).resolve().parent


def public(value):
    return {name for name in vars(value) if not name.startswith("_")}


def test_the_stubs_are_of_what_is_compiled():
    stubs = ast.parse((PACKAGE / "_v2x.pyi").read_text(encoding="utf-8"))
    declared = {}
    for node in stubs.body:
        if isinstance(node, ast.ClassDef):
            declared[node.name] = {one.name for one in node.body if not one.name.startswith("_")}
        elif isinstance(node, ast.FunctionDef):
            declared[node.name] = set()
        elif isinstance(node, ast.AnnAssign):
            declared[node.target.id] = set()
    assert public(_v2x) == declared.keys()
    for name, members in declared.items():
        if members:
            assert public(getattr(_v2x, name)) == members, name


def test_the_examples_of_the_docstrings_hold():
    for module in (arrays, engine, lab):
        failed, tried = doctest.testmod(module)
        assert failed == 0 and tried > 0, module


def test_every_public_name_is_described():
    for module in (v2x, arrays, engine, lab):
        for name in public(module):
            value = getattr(module, name)
            if getattr(value, "__module__", "").startswith("v2x"):
                assert value.__doc__, name
                for method in public(value) if isinstance(value, type) else ():
                    member = vars(value)[method]
                    assert not (callable(member) or isinstance(member, property)) or member.__doc__, (name, method)


def test_the_package_is_typed_and_needs_only_numpy():
    assert (PACKAGE / "py.typed").exists()
    script = "import sys, v2x; print(sorted({'zenoh', 'mcap', 'pytest'} & sys.modules.keys()))"
    assert subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_arrays_have_no_hidden_padding_but_behind_bytes():
    sizes = {v2x.DETECTION: 152, v2x.OBJECT: 264, lab.BOX: 120, lab.TRUTH: 64, lab.KEYFRAME: 32}
    assert {dtype: dtype.itemsize for dtype in sizes} == sizes
