"""What Blender's extension tool accepts in silence: leftovers, tags, licence form, the zip's contents."""

import ast
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import bpy
import pytest

ROOT = Path(__file__).resolve().parents[2]
STARTS_BLENDER = ("operators/reading/second_blender.py", "operators/farm.py")
FOLDERS = ("operators", "pdm_core", "ui")
ALLOWED_TAGS = set(
    "3D View,Add Curve,Add Mesh,Animation,Bake,Camera,Compositing,Development,Game Engine,Geometry Nodes,Grease Pencil,"
    "Import-Export,Lighting,Material,Modeling,Mesh,Node,Object,Paint,Pipeline,Physics,Render,Rigging,Scene,Sculpt,"
    "Sequencer,System,Text Editor,Tracking,User Interface,UV".split(",")
)


@pytest.fixture(scope="module")
def package():
    with zipfile.ZipFile(os.environ["PDM_ZIP"]) as opened:
        yield opened


@pytest.fixture(scope="module")
def manifest(package):
    return tomllib.loads(package.read("blender_manifest.toml").decode())


def sources(package):
    return {name: package.read(name).decode() for name in package.namelist() if name.endswith(".py")}


def test_contents_are_the_sources_manifest_and_licence(package):
    expected = {"blender_manifest.toml", "__init__.py", "LICENSE"}
    expected |= {str(path.relative_to(ROOT)) for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")}
    assert {name for name in package.namelist() if not name.endswith("/")} == expected
    assert {"operators/baking/bake.py", "pdm_core/scene.py", "ui/panels.py"} <= expected


def test_manifest(manifest):
    assert manifest["id"] == "pdm_radiosity"
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert manifest["blender_version_min"] == "4.2.0"
    assert set(manifest["tags"]) == {"Bake", "Lighting"} <= ALLOWED_TAGS
    assert set(manifest["permissions"]) == {"files"}
    reason = manifest["permissions"]["files"]
    assert 0 < len(reason) <= 64 and reason[-1].isalnum()
    assert 0 < len(manifest["tagline"]) <= 64 and manifest["tagline"][-1].isalnum()


def test_no_bl_info_and_nothing_that_reviewers_reject(package):
    for name, text in sources(package).items():
        tree = ast.parse(text, name)
        names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        assert not names & {"bl_info", "exec", "eval"}, name
        modules = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
        modules |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module}
        assert not {m.split(".")[0] for m in modules} & {"socket", "urllib", "http", "requests"}, name
        # a second Blender evaluates what Cycles alone can, or bakes another file; nothing else starts programs
        assert "subprocess" not in modules or name in STARTS_BLENDER, name


def test_nothing_imports_upwards(package):
    """pdm_core knows numpy and the standard library; operators know the core; ui knows both."""
    allowed = {"pdm_core": {"pdm_core"}, "operators": {"pdm_core", "operators"}, "ui": set(FOLDERS)}
    for name, text in sources(package).items():
        folder = name.split("/")[0]
        if folder not in allowed:
            continue
        for node in ast.walk(ast.parse(text, name)):
            if isinstance(node, ast.ImportFrom) and node.level == name.count("/") + 1:
                reached = node.module.split(".")[0] if node.module else node.names[0].name
                assert reached in allowed[folder], f"{name} imports {reached}"
            if folder == "pdm_core" and isinstance(node, ast.Import | ast.ImportFrom) and not getattr(node, "level", 0):
                module = node.module if isinstance(node, ast.ImportFrom) else node.names[0].name
                assert module.split(".")[0] in sys.stdlib_module_names | {"numpy"}, f"{name} imports {module}"


def test_blenders_own_tool_finds_nothing(package):
    tool = Path(bpy.utils.system_resource("SCRIPTS", path="addons_core")) / "bl_pkg" / "cli" / "blender_ext.py"
    done = subprocess.run([sys.executable, tool, "validate", package.filename], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
