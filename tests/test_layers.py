"""Arrows and fences of the package: who may import whom, and where a heavy library may be named."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

LAYERS = [  # From the bottom. A part imports from lines below its own, and from itself; the base may import the base.
    {"core", "i18n", "realtime"},
    {"robots"},
    {"model"},
    {"motion"},
    {"conformance"},
    {"sim", "recording", "views"},
    {"makers"},
    {"execution"},
    {"control_process"},
    {"app"},
    {"workbench", "notebook"},
    {"diagnostics"},
    {""},  # rcilab itself, the lazy front door: only the top goes through it.
    {"cli"},
    {"__main__"},
]
HEIGHT = {part: height for height, parts in enumerate(LAYERS) for part in parts}

FENCES = {
    "pinocchio": ("model/", "diagnostics/bench/compare/"),  # There it is one of the compared.
    "coal": ("model/kinematics/collision.py",),
    "eigenpy": ("model/dynamics/symmetric_solver.py",),
    "ruckig": ("motion/_ruckig.py",),
    "mujoco": ("sim/mujoco_plant.py",),
    "viser": ("views/", "workbench/", "notebook/"),
    "meshcat": ("views/", "notebook/"),
    "yourdfpy": ("views/", "workbench/", "notebook/"),
    "mcap": ("recording/",),
    "pandas": ("recording/",),
    "pyarrow": ("recording/",),
    "matplotlib": ("views/", "notebook/"),
    "ipywidgets": ("notebook/",),
    "IPython": ("notebook/",),
    "pink": ("diagnostics/bench/compare/",),
    "ssik": ("diagnostics/bench/compare/",),
    "toppra": ("diagnostics/bench/compare/",),
}

MODULES = sorted((ROOT / "rcilab").rglob("*.py"))
NAMES = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for path in MODULES}


def imports(path: Path) -> Iterator[str]:
    """Every module that a file imports, in functions and under TYPE_CHECKING too, by absolute name."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: write imports absolutely"
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                yield full if full in NAMES else str(node.module)


def part_of(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_imports_go_down_only_and_heavy_libraries_stay_fenced(path: Path) -> None:
    place = path.relative_to(ROOT / "rcilab").as_posix()
    own = part_of(".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"))
    for module in imports(path):
        library = module.split(".")[0]
        if library == "rcilab":
            other = part_of(module)
            allowed = other == own or HEIGHT[other] < HEIGHT[own] or HEIGHT[other] == HEIGHT[own] == 0
            assert allowed, f"{place} imports {module}, which is not below it"
        fence = FENCES.get(library)
        assert fence is None or place.startswith(fence), f"{place} imports {library}, fenced to {', '.join(fence)}"


def test_the_application_layer_loads_no_user_interface() -> None:
    modules = sorted(name for name in NAMES if name.startswith("rcilab.app"))
    libraries = ["viser", "meshcat", "yourdfpy", "ipywidgets", "IPython", "matplotlib"]
    code = (
        f"import importlib, sys; [importlib.import_module(name) for name in {modules}];"
        f"print(*[name for name in {libraries} if name in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert result.stdout.split() == []
    drawing = {
        f"rcilab.views.{path.stem}"
        for path in (ROOT / "rcilab/views").glob("*.py")
        if {"viser", "meshcat"} & {module.split(".")[0] for module in imports(path)}
    }
    for name in modules:
        path = ROOT.joinpath(*name.split("."))
        used = set(imports(path / "__init__.py" if path.is_dir() else path.with_suffix(".py")))
        assert not used & drawing, f"{name} imports {', '.join(used & drawing)}"


def test_no_module_is_outside_the_layers() -> None:
    assert {part_of(name) for name in NAMES} <= HEIGHT.keys()


def test_importing_the_package_loads_no_heavy_library() -> None:
    heavy = ["pinocchio", "coal", "mujoco", "viser", "ruckig", "matplotlib", "meshcat", "yourdfpy", "IPython"]
    code = f"import sys, rcilab; print(*[name for name in {heavy} if name in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert result.stdout.split() == []
