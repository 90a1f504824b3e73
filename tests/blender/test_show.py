"""Show Baked Colours: every 3D view of the screen, and back exactly as it was."""

import bpy
import pytest

TELLTALE = (
    "type light color_type show_xray show_shadows show_cavity use_dof studio_light show_xray_wireframe "
    "wireframe_color_type background_type show_backface_culling"
).split()  # fmt: skip


@pytest.fixture
def screen():
    """The Animation screen of the factory file: two 3D views."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    return bpy.data.screens["Animation"]


def shadings(screen):
    return [area.spaces.active.shading for area in screen.areas if area.type == "VIEW_3D"]


def state(screen):
    return [[getattr(shading, name) for name in TELLTALE] for shading in shadings(screen)]


def toggle(screen):
    with bpy.context.temp_override(screen=screen):
        assert bpy.ops.pdm.show_colours() == {"FINISHED"}


def test_every_view_shows_the_colours_and_is_put_back(screen, addon):
    first, second = shadings(screen)
    first.type, first.light, first.show_cavity, first.show_xray = "SOLID", "MATCAP", True, True
    second.type, second.use_dof = "WIREFRAME", False
    second.show_xray_wireframe = False
    before = state(screen)
    toggle(screen)
    assert addon("operators.show_colours").is_shown(screen)
    for shading in (first, second):
        assert (shading.type, shading.light, shading.color_type) == ("SOLID", "FLAT", "VERTEX")
        assert not (shading.show_xray or shading.show_cavity or shading.show_shadows)
    toggle(screen)
    assert state(screen) == before and not addon("operators.show_colours").is_shown(screen)


def test_rendered_and_material_views_come_back(screen):
    first, second = shadings(screen)
    first.type, second.type = "MATERIAL", "RENDERED"
    before = state(screen)
    toggle(screen)
    toggle(screen)
    assert state(screen) == before


def test_a_view_that_the_user_has_switched_since_stays_so(screen):
    toggle(screen)
    first, second = shadings(screen)
    first.type = "WIREFRAME"
    toggle(screen)
    assert first.type == "WIREFRAME" and (second.type, second.light) == ("SOLID", "STUDIO")


def test_shown_twice_the_first_state_is_kept(screen, addon):
    shadings(screen)[0].light = "MATCAP"
    before = state(screen)
    module = addon("operators.show_colours")
    module.show(screen)
    module.show(screen)  # as after a second bake
    module.put_back(screen)
    assert state(screen) == before


def test_scripts_do_not_switch_views(screen):
    import scenes

    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    scenes.lit_ball()
    before = state(bpy.context.screen)
    bpy.ops.pdm.bake()
    assert state(bpy.context.screen) == before
