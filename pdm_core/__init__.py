"""Diffuse light between exact flat shapes and spheres, and meshes: form factors, radiosity, gathering. Needs numpy."""

from .checked import SceneError
from .form_factors import FormFactors, form_factors
from .lights import AreaLight, PointLight, SpotLight, SunLight
from .plan import Plan, plan
from .published import pdm_form_factor
from .radiosity import Progress, Solution, solve, solve_steps
from .scene import Light, Scene, Surface
from .shapes.mesh import Mesh
from .shapes.plane import Plane
from .shapes.polygon import Polygon
from .shapes.sphere import Sphere

__all__ = [
    "AreaLight",
    "FormFactors",
    "Light",
    "Mesh",
    "Plan",
    "Plane",
    "PointLight",
    "Polygon",
    "Progress",
    "Scene",
    "SceneError",
    "Solution",
    "Sphere",
    "SpotLight",
    "SunLight",
    "Surface",
    "form_factors",
    "pdm_form_factor",
    "plan",
    "solve",
    "solve_steps",
]
