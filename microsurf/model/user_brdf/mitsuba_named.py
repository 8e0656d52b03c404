"""``--model mitsuba:PLUGIN,KEY=VALUE,…``: any BSDF of Mitsuba by its dictionary.

What the scene says of the material and of the roughness is filled in where the plug-in has a
parameter for it and none is given. STD slopes of γ = 2 are GGX with α = σ, those of γ → ∞ are
Beckmann's with α = σ; between them only our own plug-in ``ilstd`` has the scene's roughness, and
it is registered here.
"""

import json
import math
import re
from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any

from ...errors import InputError
from ...scene import Scene
from .brdf import UserBrdf
from .mitsuba_bsdf import Bridge, load, scalar, user_brdf

PREFIX = "mitsuba:"
_BECKMANN = 1e4
"""γ from which STD slopes are Beckmann's: G1 differs by 2e−5."""
_WRITTEN = {"true": True, "false": False}
_LINE = 300

Parameters = dict[str, Any]


def load_mitsuba(name: str) -> UserBrdf:
    """Find a BSDF of Mitsuba by what stands on the command line.

    Raises
    ------
    InputError
        If it is not written so, or Mitsuba is not installed. That there is such a plug-in with
        such parameters shows when it is asked on a scene.

    """
    given = _read(name)
    load()

    def parameters_of(scene: Scene) -> Parameters:
        return {"type": given["type"], **implied(name, given, scene), **given}

    def bridge_of(scene: Scene) -> Bridge:
        return _bridge(name, json.dumps(parameters_of(scene)))

    def notes(scene: Scene) -> list[str]:
        filled = implied(name, given, scene)
        shown = ", ".join(f"{key} = {_shown(value)}" for key, value in filled.items())
        line = f"{name}: the scene gives {shown or 'none of its parameters'}"
        return [f"{line}; what is not given is Mitsuba's default", *bridge_of(scene).notes()]

    return user_brdf(name, bridge_of, notes)


def _read(name: str) -> Parameters:
    plugin, *rest = name.removeprefix(PREFIX).split(",")
    pairs = [word.partition("=") for word in rest]
    if not plugin or any(not key or not value for key, _, value in pairs):
        raise InputError(
            f"--model {name}: must be mitsuba:PLUGIN,KEY=VALUE,… as in "
            "mitsuba:roughplastic,alpha=0.3,nonlinear=true"
        )
    return {"type": plugin, **{key: _value(text) for key, _, text in pairs}}


def _value(text: str) -> bool | int | float | str:
    if text in _WRITTEN:
        return _WRITTEN[text]
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


@cache
def _bridge(name: str, written: str) -> Bridge:
    mi, parameters = load(), json.loads(written)
    with scalar():
        if parameters["type"] in _OURS:
            # Plug-ins stand right of models: they are registered when one is named.
            import_module(_OURS[parameters["type"]]).register()
        try:
            bsdf = mi.load_dict(parameters)
        except Exception as error:
            # Its text has places in Mitsuba's sources, and several lines.
            text = " ".join(re.sub(r"\[\w+\.\w+:\d+\] ", "", str(error)).split())
            text = text.rpartition('node "root": ')[2]
            raise InputError(
                f"--model {name}: Mitsuba says: {text[:_LINE]}; name a BSDF of "
                "Mitsuba and parameters that it has"
            ) from error
        return Bridge(bsdf, name)


def implied(name: str, given: Parameters, scene: Scene) -> Parameters:
    """Parameters that a scene of one Kd implies for a plug-in and that are not given.

    Raises
    ------
    InputError
        If the scene's roughness is none that the plug-in has, and no other is given.

    """
    of_plugin = _IMPLIED.get(given["type"])
    if of_plugin is None:
        return {}
    of_material, roughness_keys, of_roughness = of_plugin
    parameters = of_material(scene)
    if not any(set(keys) <= given.keys() for keys in roughness_keys):
        parameters |= of_roughness(name, scene)
    for key, others in _INSTEAD.items():
        if key in given:
            parameters = {
                other: value for other, value in parameters.items() if other not in others
            }
    return {key: value for key, value in parameters.items() if key not in given}


def _plastic(scene: Scene) -> Parameters:
    _, (kd,) = scene.material, scene.material.kd
    return {"int_ior": float(scene.material.n), "ext_ior": 1.0, "diffuse_reflectance": kd}


def _conductor(scene: Scene) -> Parameters:
    """Facets without a substrate: Fresnel's formula of n + ik is the dielectric's at k = 0."""
    return {"eta": float(scene.material.n), "k": float(scene.material.k)}


def _diffuse(scene: Scene) -> Parameters:
    return {"reflectance": scene.material.kd[0]}


def _principled(scene: Scene) -> Parameters:
    material = scene.material
    if material.conductor:
        at_normal = ((material.n - 1) ** 2 + material.k**2) / (
            (material.n + 1) ** 2 + material.k**2
        )
        return {"metallic": 1.0, "base_color": at_normal}
    return {"base_color": material.kd[0], "eta": float(material.n)}


def _smooth(_name: str, _scene: Scene) -> Parameters:
    return {}


def _distribution(name: str, scene: Scene) -> str:
    gamma = scene.roughness.gamma
    if scene.surface.file is not None:
        raise InputError(f"--model {name}: the scene's surface is a file's; give the roughness")
    if gamma == 2:
        return "ggx"
    if gamma >= _BECKMANN:
        return "beckmann"
    raise InputError(
        f"--model {name}: roughness.gamma = {gamma:g} is neither GGX (2) nor Beckmann (≥ "
        f"{_BECKMANN:g}); give the plug-in's roughness and distribution"
    )


def _one_sigma(name: str, scene: Scene) -> float:
    roughness = scene.roughness
    if not roughness.isotropic:
        raise InputError(
            f"--model {name}: roughness.sigma = {list(roughness.sigma)} is anisotropic; give the "
            "plug-in's roughness"
        )
    return float(roughness.sigma_x)


def _alpha(name: str, scene: Scene) -> Parameters:
    return {"distribution": _distribution(name, scene), "alpha": _one_sigma(name, scene)}


def _two_alphas(name: str, scene: Scene) -> Parameters:
    if scene.roughness.isotropic:
        return _alpha(name, scene)
    return {
        "distribution": _distribution(name, scene),
        "alpha_u": float(scene.roughness.sigma_x),
        "alpha_v": float(scene.roughness.sigma_y),
    }


def _disney(name: str, scene: Scene) -> Parameters:
    if _distribution(name, scene) != "ggx":
        raise InputError(
            f"--model {name}: has GGX slopes, roughness.gamma = {scene.roughness.gamma:g}; give "
            "its roughness"
        )
    return {"roughness": math.sqrt(_one_sigma(name, scene))}


def _ilstd_material(scene: Scene) -> Parameters:
    if scene.material.conductor:
        return _conductor(scene)
    return {"int_ior": float(scene.material.n), "diffuse_reflectance": scene.material.kd[0]}


def _ilstd(name: str, scene: Scene) -> Parameters:
    rough = scene.roughness
    if scene.surface.file is not None:
        raise InputError(f"--model {name}: the scene's surface is a file's; give the roughness")
    return {
        "gamma": float(rough.gamma),
        "sigma_u": float(rough.sigma_x),
        "sigma_v": float(rough.sigma_y),
    }


_OURS = {"ilstd": "microsurf.mitsuba"}
"""Plug-ins that are ours, and the module that registers each."""
_INSTEAD = {
    "alpha": {"alpha_u", "alpha_v"},
    "alpha_u": {"alpha"},
    "alpha_v": {"alpha"},
    "material": {"eta", "k"},
    "specular": {"eta"},
    "sigma": {"sigma_u", "sigma_v"},
}
"""What a parameter that is given stands for: Mitsuba refuses both."""
_ALPHA = ("alpha", "distribution")
_ALPHAS = ("alpha_u", "alpha_v", "distribution")
_STD, _STDS = ("gamma", "sigma"), ("gamma", "sigma_u", "sigma_v")
_IMPLIED: dict[
    str,
    tuple[
        Callable[[Scene], Parameters],
        tuple[tuple[str, ...], ...],
        Callable[[str, Scene], Parameters],
    ],
] = {
    "diffuse": (_diffuse, (), _smooth),
    "plastic": (_plastic, (), _smooth),
    "conductor": (_conductor, (), _smooth),
    "roughplastic": (_plastic, (_ALPHA,), _alpha),
    "roughconductor": (_conductor, (_ALPHA, _ALPHAS), _two_alphas),
    "principled": (_principled, (("roughness",),), _disney),
    "ilstd": (_ilstd_material, (_STD, _STDS), _ilstd),
}
"""By plug-in: of the material, parameters that state all of the roughness, of the roughness."""
