"""PDM Radiosity: diffuse light between exact shapes and meshes, baked into vertex colours."""


def register():
    from . import operators, ui

    operators.register()
    ui.register()


def unregister():
    from . import operators, ui

    ui.unregister()
    operators.unregister()
