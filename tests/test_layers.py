"""Arrows and fences of the package: who may import whom, and where a heavy library may be named."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

LAYERS = [  # From the bottom. A part imports from lines below its own, and from itself.
    {"core"},
    {"i18n", "realtime"},
    {"robots"},
    {"model"},
    {"motion"},
    {"cell"},
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
    "pinocchio": ("model/", "cell/cell_geometry.py", "diagnostics/bench/compare/"),  # There it is one of the compared.
    "coal": ("model/kinematics/collision.py", "cell/"),
    "eigenpy": ("model/dynamics/symmetric_solver.py",),
    "ruckig": ("motion/_ruckig.py",),
    "trimesh": ("cell/",),
    "coacd": ("cell/convex_parts.py",),
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
    "pylibfranka": ("makers/franka/driver/", "diagnostics/bench/official_clients.py"),
    "panda_py": ("makers/franka/driver/",),
}

LATE_TARGETS = {  # What a function may import, and why not the module.
    "rcilab.core.cycle_log": "loads numpy",
    "rcilab.model.dynamics.rigid_body": "loads pinocchio",
    "rcilab.model.dynamics.symmetric_solver": "loads eigenpy",
    "rcilab.cell.cell_geometry": "loads coal and pinocchio",
    "rcilab.model.kinematics.collision": "loads coal and pinocchio",
    "rcilab.sim.mujoco_plant": "loads mujoco",
    "rcilab.views.meshcat_scene": "loads meshcat",
    "rcilab.views.viser_scene": "loads viser",
    "rcilab.views.viser_server": "loads viser",
}
LATE_PARTS = {"cli": "a command loads what it needs and not what the others do"}
LATE_FILES = re.compile(r"rcilab\.makers\.\w+\.maker")
"""A maker is cheap to import: its codec, controller and driver are loaded by the methods that need them."""
NAMES_A_MAKER = {
    "rcilab.diagnostics.bench.controller": "measures codec and controller of the RCI",
    "rcilab.diagnostics.bench.franka": "measures the controller of the FCI",
    "rcilab.diagnostics.bench.record": "measures the record of the RCI controller",
    "rcilab.diagnostics.bench.ufactory": "measures the controller of the xArm interface",
}
"""Modules outside `makers` that import a maker's folder, and why."""

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


def runtime_imports(path: Path) -> Iterator[tuple[str, bool]]:
    """Every module of rcilab that a file imports when it runs, and whether in a function; not under TYPE_CHECKING."""

    def visit(node: ast.AST, is_late: bool) -> Iterator[tuple[str, bool]]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test):
                yield from (found for other in child.orelse for found in visit(other, is_late))
                continue
            if isinstance(child, ast.Import):
                yield from ((alias.name, is_late) for alias in child.names if alias.name.split(".")[0] == "rcilab")
            elif isinstance(child, ast.ImportFrom) and str(child.module).split(".")[0] == "rcilab":
                for alias in child.names:
                    full = f"{child.module}.{alias.name}"
                    yield full if full in NAMES else str(child.module), is_late
            yield from visit(child, is_late or isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda))

    yield from visit(ast.parse(path.read_text(encoding="utf-8")), False)


def name_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def circles(edges: dict[str, set[str]]) -> set[tuple[str, ...]]:
    """Groups of modules that import each other, directly or through others."""
    reached: dict[str, set[str]] = {}
    for start in edges:
        seen: set[str] = set()
        waiting = [start]
        while waiting:
            for target in edges.get(waiting.pop(), set()) - seen:
                seen.add(target)
                waiting.append(target)
        reached[start] = seen
    return {
        tuple(sorted({other for other in seen if start in reached.get(other, set())}))
        for start, seen in reached.items()
        if start in seen
    }


def part_of(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_imports_go_down_only_and_heavy_libraries_stay_fenced(path: Path) -> None:
    place = path.relative_to(ROOT / "rcilab").as_posix()
    own = part_of(name_of(path))
    for module in imports(path):
        library = module.split(".")[0]
        if library == "rcilab":
            other = part_of(module)
            assert other == own or HEIGHT[other] < HEIGHT[own], f"{place} imports {module}, which is not below it"
        fence = FENCES.get(library)
        assert fence is None or place.startswith(fence), f"{place} imports {library}, fenced to {', '.join(fence)}"


def test_nothing_outside_the_makers_imports_one() -> None:
    folders = {f"rcilab.makers.{path.parent.name}" for path in (ROOT / "rcilab/makers").glob("*/maker.py")}
    assert folders >= {"rcilab.makers.rokae", "rcilab.makers.franka"}
    found = {
        name_of(path)
        for path in MODULES
        if part_of(name_of(path)) != "makers"
        for module in imports(path)
        if ".".join(module.split(".")[:3]) in folders
    }
    assert found == NAMES_A_MAKER.keys()


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


def test_no_modules_import_each_other_in_circles() -> None:
    edges = {name_of(path): {module for module, _ in runtime_imports(path)} - {name_of(path)} for path in MODULES}
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == {("a", "b", "c")}
    found = circles(edges)
    assert not found, "import circles: " + "; ".join(" ".join(group) for group in found)


def test_functions_import_only_what_loads_a_heavy_library() -> None:
    late: list[str] = []
    for path in MODULES:
        name = name_of(path)
        for module, is_late in runtime_imports(path):
            if is_late and not (module in LATE_TARGETS or part_of(name) in LATE_PARTS or LATE_FILES.fullmatch(name)):
                late.append(f"{name} imports {module}")
    assert not late, "function-level imports:\n" + "\n".join(late)


def test_what_people_read_of_neutral_rooms_names_no_command_of_a_maker() -> None:
    named = re.compile(r"robot\.rci\.|toolTobase|set_(joint|cartesian)_limit|set_filters|teach pendant")
    neutral = "core robots model motion conformance sim execution control_process".split()
    files = [path for part in neutral for path in (ROOT / "rcilab" / part).rglob("*.py")]
    found = [
        f"{path.name}:{node.lineno}"
        for path in files
        for parent in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if not isinstance(parent, ast.Expr)  # A docstring.
        for node in ast.iter_child_nodes(parent)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and named.search(node.value)
    ]
    assert found == []


def test_no_module_is_outside_the_layers() -> None:
    assert {part_of(name) for name in NAMES} <= HEIGHT.keys()


def test_importing_the_package_loads_no_heavy_library() -> None:
    heavy = ["pinocchio", "coal", "mujoco", "viser", "ruckig", "matplotlib", "meshcat", "yourdfpy", "IPython", "babel"]
    code = f"import sys, rcilab; print(*[name for name in {heavy} if name in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert result.stdout.split() == []
