"""Diffuse light between exact planes and spheres: form factors, radiosity, gathering. Needs numpy only."""

from .checked import SceneError
from .form_factors import FormFactors, form_factors, pdm_form_factor
from .plan import Plan, plan
from .radiosity import Progress, Solution, solve, solve_steps
from .scene import Plane, Scene, Sphere, Surface

__all__ = [
    "FormFactors",
    "Plan",
    "Plane",
    "Progress",
    "Scene",
    "SceneError",
    "Solution",
    "Sphere",
    "Surface",
    "form_factors",
    "pdm_form_factor",
    "plan",
    "solve",
    "solve_steps",
]
