"""Measured BRDFs made from a model, for tests."""

import numpy as np

from microsurf.analysis.brdf_fit.materials import MATERIALS, lobes
from microsurf.analysis.brdf_fit.parameters import Layout
from microsurf.analysis.brdf_fit.problem import problem_of
from microsurf.analysis.brdf_fit.solve import Question, model
from microsurf.results.measured_brdf.scattered import MeasuredBrdf


def directions(incidences=8, pairs=24, azimuths=(0.0,), seed=1, most=75.0):
    """Return pairs of directions, a third of them within some 12° of the mirror direction."""
    rng = np.random.default_rng(seed)
    theta = np.repeat(np.radians(np.linspace(0, most, incidences)), pairs)
    theta_i = np.tile(theta, len(azimuths))
    phi_i = np.repeat(azimuths, len(theta)).astype(float)
    count = len(theta_i)
    theta_o = np.arccos(1 - rng.random(count) * (1 - np.cos(np.radians(most))))
    phi_o = 2 * np.pi * rng.random(count)
    near = rng.random(count) < 0.33
    wide = np.radians(12) * rng.standard_normal((2, count))
    theta_o = np.where(near, np.clip(np.abs(theta_i + wide[0]), 0, np.radians(most)), theta_o)
    phi_o = np.where(near, phi_i + np.pi + wide[1], phi_o)
    return theta_i, phi_i, theta_o, phi_o


def measured(angles, values, source="made"):
    """Return the BRDF of these pairs."""
    nanometres = tuple(400.0 + 100 * k for k in range(values.shape[1]))
    channels = tuple(f"{w:g} nm" for w in nanometres)
    return MeasuredBrdf(*angles, values, channels, nanometres, source=source)


def closed_form(name, vector, channel, angles, isotropic=True, eta=None):
    """Return the BRDF of order 1 of a material at a vector of parameters, without noise."""
    channel = np.asarray(channel, float)
    empty = measured(angles, np.zeros((len(angles[0]), len(channel))))
    material = MATERIALS[name]
    layout = Layout(material.optics, eta, isotropic)
    problem = problem_of(empty, isotropic=isotropic)
    question = Question(problem, material, layout)
    vector = np.asarray(vector, float)
    if eta is not None:
        vector = np.delete(vector, 1 if isotropic else 3)
    made = lobes(problem, material, layout, vector)
    return measured(angles, model(question, made, vector, channel))
