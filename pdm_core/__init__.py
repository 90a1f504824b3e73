"""Diffuse light between exact planes and spheres: form factors, radiosity, gathering. Needs numpy only."""

from .checked import SceneError
from .form_factors import FormFactors, form_factors, pdm_form_factor
from .lights import AreaLight, PointLight, SpotLight, SunLight
from .plan import Plan, plan
from .radiosity import Progress, Solution, solve, solve_steps
from .scene import Light, Plane, Scene, Sphere, Surface

__all__ = [
    "AreaLight",
    "FormFactors",
    "Light",
    "Plan",
    "Plane",
    "PointLight",
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
