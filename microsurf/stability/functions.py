"""The formulas of `physics` that the map asks, each beside its reference."""

from ..physics import facet, fresnel, smith, student_t, vcavity, visible_normals
from . import reference
from .case import CheckedFunction
from .domain import unit
from .reference import Real

_AZIMUTH = 23.0  # of what is anisotropic
_RATIO = 0.1  # σ_y/σ_x there
_TILT = (30.0, 20.0)  # θ, φ of the facet whose visibility is asked
_OTHER = 75.0  # θ of the second direction of G2


def _direction(theta: float) -> tuple[float, float]:
    w = unit(theta)
    return float(w[0]), float(w[2])


def _of_slopes() -> tuple[CheckedFunction, ...]:
    return (
        CheckedFunction(
            "D", "slopes", ("theta", "gamma", "sigma"), ("gamma", "sigma", "mx", "mz"),
            lambda theta, gamma, sigma: (gamma, sigma, *_direction(theta)),
            lambda gamma, sigma, mx, mz: student_t.distribution([mx, 0, mz], gamma, sigma),
            lambda gamma, sigma, mx, mz: reference.distribution(gamma, sigma, sigma, mx, 0, mz),
        ),
        CheckedFunction(
            "density of slopes", "slopes", ("rho", "gamma", "sigma"),
            ("gamma", "sigma", "p"),
            lambda rho, gamma, sigma: (gamma, sigma, rho * sigma),
            lambda gamma, sigma, p: student_t.slope_density(p, 0, gamma, sigma),
            lambda gamma, sigma, p: reference.slope_density(gamma, sigma, sigma, p, 0),
        ),
        CheckedFunction(
            "CDF of |slope|", "slopes", ("rho", "gamma"), ("gamma", "sigma", "r"),
            lambda rho, gamma: (gamma, 0.5, rho / 2),
            lambda gamma, sigma, r: student_t.slope_cdf(r, gamma, sigma),
            reference.slope_cdf,
        ),
        CheckedFunction(
            "quantile of |slope|", "slopes", ("u", "gamma"), ("gamma", "sigma", "u"),
            lambda u, gamma: (gamma, 0.5, u),
            lambda gamma, sigma, u: student_t.slope_quantile(u, gamma, sigma),
            reference.slope_quantile,
        ),
        CheckedFunction(
            "share of area beyond a slope", "slopes", ("rho", "gamma", "wide"),
            ("gamma", "sigma", "slope"),
            lambda rho, gamma, sigma: (gamma, sigma, rho * sigma),
            lambda gamma, sigma, slope: student_t.area_beyond(slope, gamma, sigma),
            reference.area_beyond,
        ),
        CheckedFunction(
            "mean area", "slopes", ("wide", "gamma"), ("gamma", "sigma"),
            lambda sigma, gamma: (gamma, sigma),
            student_t.mean_area,
            reference.mean_area,
        ),
    )  # fmt: skip


def _of_masking() -> tuple[CheckedFunction, ...]:
    inputs = ("gamma", "sigma", "wx", "wz")
    axes = ("theta", "gamma", "sigma")

    def place(theta: float, gamma: float, sigma: float) -> tuple[float, ...]:
        return (gamma, sigma, *_direction(theta))

    def both(theta: float, gamma: float, sigma: float) -> tuple[float, ...]:
        return (*place(theta, gamma, sigma), *_direction(_OTHER))

    def exact(gamma: Real, sigma: Real, wx: Real, wz: Real) -> Real:
        return reference.smith_lambda(gamma, sigma, sigma, wx, 0, wz)

    def stretched(theta: float, gamma: float, sigma: float) -> tuple[float, ...]:
        return (gamma, sigma, _RATIO * sigma, *map(float, unit(theta, _AZIMUTH)))

    def tilted(theta: float, gamma: float, sigma: float) -> tuple[float, ...]:
        return (*stretched(theta, gamma, sigma), *map(float, unit(*_TILT)))

    return (
        CheckedFunction(
            "Λ", "masking", axes, inputs, place,
            lambda gamma, sigma, wx, wz: smith.smith_lambda([wx, 0, wz], gamma, sigma), exact,
        ),
        CheckedFunction(
            "Λ, σ_x = 10 σ_y", "masking", axes, ("gamma", "sigma_x", "sigma_y", "wx", "wy", "wz"),
            stretched,
            lambda gamma, sx, sy, wx, wy, wz: smith.smith_lambda([wx, wy, wz], gamma, sx, sy),
            reference.smith_lambda,
        ),
        CheckedFunction(
            "G1, Smith", "masking", axes, inputs, place,
            lambda gamma, sigma, wx, wz: smith.g1([wx, 0, wz], gamma, sigma),
            lambda *given: 1 / (1 + exact(*given)),
        ),
        CheckedFunction(
            "G2, separable", "masking", axes, (*inputs, "ox", "oz"), both,
            lambda gamma, sigma, wx, wz, ox, oz: smith.g2_separable(
                [wx, 0, wz], [ox, 0, oz], gamma, sigma
            ),
            lambda gamma, sigma, wx, wz, ox, oz: 1
            / ((1 + exact(gamma, sigma, wx, wz)) * (1 + exact(gamma, sigma, ox, oz))),
        ),
        CheckedFunction(
            "G2, height-correlated", "masking", axes, (*inputs, "ox", "oz"), both,
            lambda gamma, sigma, wx, wz, ox, oz: smith.g2_height_correlated(
                [wx, 0, wz], [ox, 0, oz], gamma, sigma
            ),
            lambda gamma, sigma, wx, wz, ox, oz: 1
            / (1 + exact(gamma, sigma, wx, wz) + exact(gamma, sigma, ox, oz)),
        ),
        CheckedFunction(
            "projected area, from above", "masking", axes, inputs, place,
            lambda gamma, sigma, wx, wz: visible_normals.projected_area([wx, 0, wz], gamma, sigma),
            lambda gamma, sigma, wx, wz: reference.projected_area(gamma, sigma, sigma, wx, 0, wz),
        ),
        CheckedFunction(
            "projected area, from below", "masking", ("below", "gamma", "sigma"), inputs, place,
            lambda gamma, sigma, wx, wz: visible_normals.projected_area([wx, 0, wz], gamma, sigma),
            lambda gamma, sigma, wx, wz: reference.projected_area(gamma, sigma, sigma, wx, 0, wz),
        ),
        CheckedFunction(
            "density of visible normals", "masking", axes,
            ("gamma", "sigma_x", "sigma_y", "wx", "wy", "wz", "mx", "my", "mz"), tilted,
            lambda gamma, sx, sy, wx, wy, wz, mx, my, mz: visible_normals.density(
                [wx, wy, wz], [mx, my, mz], gamma, sx, sy
            ),
            reference.visible_density,
        ),
        CheckedFunction(
            "G1, V-cavity", "masking", ("theta", "tilt"), ("wx", "wz", "mx", "mz"),
            lambda theta, tilt: (*_direction(theta), *_direction(tilt)),
            lambda wx, wz, mx, mz: vcavity.g1([wx, 0, wz], [mx, 0, mz]),
            reference.vcavity_masking,
        ),
    )  # fmt: skip


def _of_facets() -> tuple[CheckedFunction, ...]:
    def cosine(theta: float) -> float:
        return _direction(theta)[1]

    return (
        CheckedFunction(
            "F", "facet", ("n", "theta"), ("mu", "n"),
            lambda n, theta: (cosine(theta), n), fresnel.reflectance, reference.reflectance,
        ),
        CheckedFunction(
            "T = 1 − F", "facet", ("n", "theta"), ("mu", "n"),
            lambda n, theta: (cosine(theta), n), fresnel.transmittance, reference.transmittance,
        ),
        CheckedFunction(
            "F of a conductor", "facet", ("metal", "theta", "k"), ("mu", "n", "k"),
            lambda n, theta, k: (cosine(theta), n, k), fresnel.reflectance, reference.reflectance,
        ),
        CheckedFunction(
            "T of a conductor", "facet", ("metal", "theta", "k"), ("mu", "n", "k"),
            lambda n, theta, k: (cosine(theta), n, k),
            fresnel.transmittance, reference.transmittance,
        ),
        CheckedFunction(
            "r_e", "facet", ("n",), ("n",), lambda n: (n,),
            fresnel.external_diffuse_reflectance, reference.external_reflectance,
        ),
        CheckedFunction(
            "1 − r_e", "facet", ("n",), ("n",), lambda n: (n,),
            fresnel.external_diffuse_transmittance, reference.external_transmittance,
        ),
        CheckedFunction(
            "r_i", "facet", ("n",), ("n",), lambda n: (n,),
            fresnel.internal_diffuse_reflectance, reference.internal_reflectance,
        ),
        CheckedFunction(
            "body weight", "facet", ("n", "kd"), ("n", "kd"), lambda n, kd: (n, kd),
            facet.body_weight, reference.body_weight,
        ),
        CheckedFunction(
            "f_b of a facet", "facet", ("n", "theta", "kd"), ("mu", "n", "kd", "mu_o"),
            lambda n, theta, kd: (cosine(theta), n, kd, 0.5),
            lambda mu, n, kd, mu_o: facet.body(mu, mu_o, n, kd), reference.body,
        ),
        CheckedFunction(
            "albedo of a facet", "facet", ("n", "theta", "kd"), ("mu", "n", "kd"),
            lambda n, theta, kd: (cosine(theta), n, kd), facet.albedo, reference.albedo,
        ),
    )  # fmt: skip


FUNCTIONS = (*_of_slopes(), *_of_masking(), *_of_facets())
