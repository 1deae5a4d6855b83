"""Which names of viser that are not public are used: only in `viser_ext`, and all of them listed here."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "rcilab"
PATCHES = PACKAGE / "views" / "viser_ext"

USED = {
    "assignments": {"viser._assignable_props_api", "_cast_value_recursive", "_prop_hints"},
    "client_messages": {"viser._messages", "_websock_interface"},
    "control_list": {
        "_container_handle_from_uuid", "_gui_input_handle_from_uuid", "_impl", "_label",
    },
    "icons": {"viser._gui_api", "viser._gui_handles", "viser._icons"},
    "loop_event": {"viser.infra", "viser.infra._infra", "viser.infra._async_message_buffer"},
    "message_guard": {
        "viser._messages", "viser.infra._messages", "_client_state_from_id", "_current_file_upload_states",
        "_drop_uploads_from_client", "_gui_input_handle_from_uuid", "_handle_incoming_message", "_impl",
        "_incoming_handlers", "_websock_server",
    },
    "orientation": {"viser._messages", "_impl", "_queue_scene_message"},
    "persistent_tab": {"_children", "_label"},
    "sendable": {"viser.infra._infra"},
    "server_start": {"viser._messages", "_websock_server"},
}  # fmt: skip
"""Modules of viser that are not public, and names of its objects that begin with an underscore, by our module."""

HOOKS = ("__viserMutable", "__viserTestpoints")
"""What viser's page offers to its own tests; also used by our benchmarks, which drive the page like a test."""


def private_names(path: Path) -> set[str]:
    """Private modules of viser that a file imports, and underscored attributes of anything but `self` and `cls`."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and str(node.module).split(".")[0] == "viser":
            for alias in node.names:
                module = f"{node.module}.{alias.name}" if alias.name.startswith("_") else str(node.module)
                found |= {module} - {"viser"}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name.startswith(("viser.", "viser_"))}
        elif isinstance(node, ast.Attribute) and re.match("_[a-z]", node.attr):
            if not (isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")):
                found.add(node.attr)
    return found


@pytest.mark.parametrize("name", sorted(path.stem for path in PATCHES.glob("*.py")))
def test_a_patch_uses_the_listed_names_and_says_what_would_make_it_unnecessary(name: str) -> None:
    path = PATCHES / f"{name}.py"
    assert private_names(path) == USED.get(name, set())
    if name in USED:
        assert "\nUnnecessary once " in (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "")


def test_no_other_module_uses_private_names_of_viser() -> None:
    names = set().union(*USED.values())
    for path in sorted(PACKAGE.rglob("*.py")):
        if path.parent != PATCHES:
            found = private_names(path)
            assert not found & names, f"{path}: {found & names}"
            assert not any(name.startswith("viser") for name in found), f"{path}: {found}"


def test_the_listed_modules_exist() -> None:
    for module in set().union(*USED.values()):
        if module.startswith("viser"):
            importlib.import_module(module)


def test_only_benchmarks_and_the_scripts_for_labels_and_scene_use_the_hooks_of_the_page() -> None:
    users = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*")
        if path.suffix in (".py", ".js") and any(hook in path.read_text(encoding="utf-8") for hook in HOOKS)
    }
    scripts = {f"workbench/assets/{name}.js" for name in ("labels", "scene3d")}
    assert {user for user in users if not user.startswith("diagnostics/bench/")} == scripts


@pytest.mark.parametrize("script", ["folds", "labels", "marks", "names", "resend", "scene3d"])
def test_a_script_that_works_around_viser_says_what_would_make_it_unnecessary(script: str) -> None:
    head = (PACKAGE / "workbench" / "assets" / f"{script}.js").read_text(encoding="utf-8").partition("(() => {")[0]
    assert "// Unnecessary once viser " in head
