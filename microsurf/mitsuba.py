"""The plug-in ``ilstd`` of Mitsuba 3: interfaced-Lambertian facets of STD slopes.

    import mitsuba as mi, microsurf.mitsuba
    mi.set_variant("llvm_ad_rgb")
    microsurf.mitsuba.register()
    mi.load_dict({"type": "ilstd", "gamma": 1.75, "sigma": 0.4, "diffuse_reflectance": 0.8})

Parameters: ``gamma`` (> 3/2, default 2); ``sigma``, or ``sigma_u`` and ``sigma_v`` (default 0.3);
``int_ior`` (relative, default 1.5) and ``diffuse_reflectance`` (texture or spectrum, default
0.5); or a conductor's ``eta`` and ``k`` instead of both; ``orders``, "1" (default) or "all", which
adds `later_orders` to the diffuse component, for one sigma and facets with a substrate. D and F
are closed forms, Λ, the body term and later orders are tables. ``mi.traverse`` shows gamma,
sigma_u, sigma_v and int_ior too, and ``params.update()`` tabulates anew. Mitsuba is an extra,
``pip install 'microsurf[mitsuba]'``, from 3.7 on, whose ``Properties`` and ``traverse`` it calls,
to 3.9.
"""

from importlib import import_module
from typing import Any

import numpy as np

from .errors import InputError
from .model.lookup import shader_facets
from .model.lookup.pair_table import MOST_THETA
from .model.lookup.shader_facets import ShaderFacets
from .model.lookup.shader_lookup import linear
from .model.lookup.shader_tables import LAMBDA_STEPS, shader_tables
from .model.random_walk.later_orders import BODIES, POLAR, later_orders
from .model.single_scattering.facets import Facets
from .model.user_brdf.mitsuba_bsdf import load
from .physics import fresnel, visible_normals
from .scene import Material, Roughness

_BECKMANN = 1e7
"""Largest γ: beyond, float32 has none of its digits."""


def register() -> None:
    """Make ``ilstd`` known to the variant of Mitsuba that is set; call it after ``set_variant``.

    Raises
    ------
    InputError
        If Mitsuba is not installed.

    """
    mi = load()
    # Mitsuba's classes are extended by one class alone: no second base, its methods then.
    methods = {k: v for k, v in vars(Ilstd).items() if k not in {"__dict__", "__weakref__"}}
    known = {"mi": mi, "dr": import_module("drjit")}
    mi.register_bsdf("ilstd", type("ilstd", (mi.BSDF,), methods | known))


class Ilstd:
    """What makes a BSDF of Mitsuba the plug-in, whatever the variant; see the module's text."""

    mi: Any
    dr: Any

    def __init__(self, props: Any) -> None:
        mi = self.mi
        mi.BSDF.__init__(self, props)
        sigma = props.get("sigma", 0.3)
        numbers = {
            "gamma": props.get("gamma", 2.0),
            "sigma_u": props.get("sigma_u", sigma),
            "sigma_v": props.get("sigma_v", sigma),
        }
        self.metal = "eta" in props or "k" in props
        orders = str(props.get("orders", "1"))
        if orders not in {"1", "all"}:
            raise InputError(f'ilstd: orders = {orders}: must be "1" or "all"')
        self.later = orders == "all"
        if self.metal:
            self.eta = props.get_unbounded_texture("eta", 1.5)
            self.k = props.get_unbounded_texture("k", 0.0)
        else:
            numbers["int_ior"] = props.get("int_ior", 1.5)
            self.diffuse = props.get_texture("diffuse_reflectance", 0.5)
        self._numbers = {name: self._mutable(value) for name, value in numbers.items()}
        self._prepare()

    def _mutable(self, value: float) -> Any:
        """A number that ``params[name] = value`` can change: Python's own can't be."""
        if self._compiled():
            return self.mi.Float(value)
        return import_module("drjit.scalar").ArrayXf([value])

    def _prepare(self) -> None:
        """Check the numbers, and make the tables and flags that follow from them."""
        mi = self.mi
        # float32 has seven digits: 0.3 is meant, not 0.300000012.
        number = {name: float(f"{held[0]:.7g}") for name, held in self._numbers.items()}
        sigma = number["sigma_u"], number["sigma_v"]
        roughness = Roughness(number["gamma"], sigma)
        if min(sigma) == 0:
            raise InputError("ilstd: sigma = 0: must be > 0; smooth facets are `plastic`")
        self.n = 1.5 if self.metal else Material(number["int_ior"]).n
        self.isotropic = roughness.isotropic
        if self.later and (self.metal or not self.isotropic):
            raise InputError("ilstd: orders = all: only for one sigma, and not for conductors")
        gamma = min(roughness.gamma, _BECKMANN)
        excess = float(visible_normals.mean_excess(2 * gamma - 2))
        self._facets = ShaderFacets(gamma, sigma, excess)
        self._tabulate()
        kind = mi.BSDFFlags
        bent = 0 if self.isotropic else int(kind.Anisotropic)
        parts = [int(kind.GlossyReflection) | int(kind.FrontSide) | bent]
        if not self.metal:
            parts.append(int(kind.DiffuseReflection) | int(kind.FrontSide) | bent)
        self.m_components = parts
        self.m_flags = parts[0] | parts[-1]

    def _tabulate(self) -> None:
        slopes = self._facets
        tables = shader_tables(Facets(self.n, slopes.gamma, *slopes.sigma, k=float(self.metal)))
        self._masking = self._held(tables.masking)
        self._escape = float(fresnel.external_diffuse_transmittance(self.n)) / self.n**2
        if tables.body is not None:
            self._shape = tables.body.values.shape
            self._body = self._held(tables.body.values)
        if self.later:
            self._later = self._held(later_orders(self.n, slopes.gamma, slopes.sigma[0]))

    def _held(self, values: Any) -> Any:
        flat = np.asarray(values, np.float32).ravel()
        return self.mi.Float(flat) if self._compiled() else flat.tolist()

    def _compiled(self) -> bool:
        return not self.mi.variant().startswith("scalar")

    def _at(self, table: Any, index: Any) -> Any:
        if self._compiled():
            return self.dr.gather(self.mi.Float, table, index)
        return table[int(index)]

    def _linear(self, table: Any, places: list[tuple[Any, int]]) -> Any:
        return linear(self.mi, self.dr, lambda index: self._at(table, index), places)

    def _masked(self, wi: Any, wo: Any) -> Any:
        """G2/cosθ_i of height-correlated masking, without a quotient by either cosine."""
        total = wi.z * wo.z
        for one, other in ((wi, wo), (wo, wi)):
            rough = self._facets.across(self.dr, one) + one.z
            u = 1 - one.z / rough
            table = self._linear(self._masking, [(u * LAMBDA_STEPS, LAMBDA_STEPS + 1)])
            total = total + table * rough * other.z
        return wo.z / total

    def _fresnel(self, cosine: Any, si: Any, active: Any) -> Any:
        if not self.metal:
            return self.mi.fresnel(cosine, self.n)[0]
        eta, k = self.eta.eval(si, active), self.k.eval(si, active)
        return shader_facets.conductor(self.dr, cosine, eta, k)

    def _weight(self, si: Any, active: Any) -> Any:
        """Body weight of `physics.facet`."""
        kd = self.diffuse.eval(si, active)
        return kd * self._escape / ((1 - kd) + kd * self._escape)

    def _unmasked_body(self, wi: Any, wo: Any) -> Any:
        mi, dr = self.mi, self.dr
        four = self._shape[1] > 1
        i, o = wi, wo
        if four:
            x, y = dr.select(wi.x < 0, -1.0, 1.0), dr.select(wi.y < 0, -1.0, 1.0)
            i, o = (mi.Vector3f(w.x * x, w.y * y, w.z) for w in (wi, wo))
        azimuth_i = dr.atan2(i.y, i.x)
        turn = dr.atan2(i.x * o.y - i.y * o.x, i.x * o.x + i.y * o.y)
        turn = dr.select(turn < 0, turn + 2 * np.pi, turn) if four else dr.abs(turn)
        polar = [
            (nodes - 1) * (1 - dr.sqrt(dr.maximum(1 - dr.safe_acos(w.z) / MOST_THETA, 0.0)))
            for w, nodes in ((i, self._shape[0]), (o, self._shape[2]))
        ]
        all_round = 2 * np.pi if four else np.pi
        steps = (
            polar[0], azimuth_i * ((self._shape[1] - 1) / (np.pi / 2)),
            polar[1], turn * ((self._shape[3] - 1) / all_round),
        )  # fmt: skip
        return self._linear(self._body, list(zip(steps, self._shape, strict=True)))

    def _later_orders(self, si: Any, wo: Any, active: Any) -> Any:
        """f of orders from 2 on."""
        mi, dr = self.mi, self.dr
        weight, power, total = self._weight(si, active), mi.Spectrum(1.0), mi.Spectrum(0.0)
        steps = [dr.safe_acos(w.z) * ((POLAR - 1) * 2 / np.pi) for w in (si.wi, wo)]
        for body in range(BODIES):
            one, other = (
                self._linear(self._later, [(mi.Float(body), BODIES), (x, POLAR)]) for x in steps
            )
            total += power * (one * other)
            power *= weight
        return total

    def _parts(self, ctx: Any) -> tuple[bool, bool]:
        kind = self.mi.BSDFFlags
        return (
            ctx.is_enabled(kind.GlossyReflection, 0),
            not self.metal and ctx.is_enabled(kind.DiffuseReflection, 1),
        )

    def _share(self, ctx: Any, si: Any, active: Any) -> Any:
        """Probability of the specular component."""
        mi, (specular, body) = self.mi, self._parts(ctx)
        if not (specular and body):
            return mi.Float(float(specular))
        mirrored = mi.fresnel(si.wi.z, self.n)[0]
        rest = (1 - mirrored) * self.dr.mean(self._weight(si, active))
        if self.later:  # about their albedo: any share is right
            rest += np.pi * self.dr.mean(self._later_orders(si, si.wi, active))
        return mirrored / (mirrored + rest)

    def _both(self, ctx: Any, si: Any, wo: Any, active: Any) -> tuple[Any, Any]:
        """f cosθ_o and the density of `sample`, of directions above the horizon."""
        mi, dr, wi = self.mi, self.dr, si.wi
        specular, body = self._parts(ctx)
        share, masked = self._share(ctx, si, active), self._masked(wi, wo)
        value, density = mi.Spectrum(0.0), mi.Float(0.0)
        if specular:
            h = dr.normalize(wi + wo)
            cosine = dr.dot(wi, h)
            distribution = self._facets.distribution(dr, h)
            value += self._fresnel(cosine, si, active) * (distribution * masked / 4)
            visible = self._facets.density(dr, wi, h, cosine)
            density += share * distribution * visible / (4 * cosine)
        if body:
            value += self._weight(si, active) * (self._unmasked_body(wi, wo) * masked)
            if self.later:
                value += self._later_orders(si, wo, active) * wo.z
            density += (1 - share) * wo.z / np.pi
        return value, density

    def sample(
        self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True
    ) -> tuple[Any, Any]:
        """Draw a component, then a visible normal or a direction by its cosine."""
        mi, dr = self.mi, self.dr
        share = self._share(ctx, si, active)
        mirrored = sample1 < share
        rest = dr.maximum(1 - share, 1e-9)
        again = dr.select(mirrored, sample1 / dr.maximum(share, 1e-9), (sample1 - share) / rest)
        p, q = self._facets.draw(dr, si.wi, again, sample2)
        m = dr.normalize(mi.Vector3f(-p, -q, 1.0))
        wo = dr.select(
            mirrored,
            2 * dr.dot(si.wi, m) * m - si.wi,
            mi.warp.square_to_cosine_hemisphere(sample2),
        )
        drawn = dr.zeros(mi.BSDFSample3f)
        drawn.wo, drawn.eta = wo, 1.0
        kind = mi.BSDFFlags
        drawn.sampled_component = dr.select(mirrored, mi.UInt32(0), mi.UInt32(1))
        drawn.sampled_type = dr.select(
            mirrored, mi.UInt32(int(kind.GlossyReflection)), mi.UInt32(int(kind.DiffuseReflection))
        )
        value, drawn.pdf = self.eval_pdf(ctx, si, wo, active)
        fine = drawn.pdf > 0
        return drawn, dr.select(fine, value / dr.select(fine, drawn.pdf, 1.0), 0.0)

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
        """f cosθ_o, and the density of `sample` in sr⁻¹."""
        mi, dr = self.mi, self.dr
        above = active & (si.wi.z > 0) & (wo.z > 0)
        if not any(self._parts(ctx)):
            above = above & False
        value, density = self._both(ctx, si, wo, above)
        return mi.depolarizer(dr.select(above, value, 0.0)), dr.select(above, density, 0.0)

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """f cosθ_o."""
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """Density of `sample` in sr⁻¹."""
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
        """Kd of the substrate, for renderers that denoise by it."""
        return self.mi.Spectrum(0.0) if self.metal else self.diffuse.eval(si, active)

    def traverse(self, callback: Any) -> None:
        """Textures, and the numbers behind the tables."""
        names = ("eta", "k") if self.metal else ("diffuse",)
        for name in names:
            shown = {"diffuse": "diffuse_reflectance"}.get(name, name)
            callback.put(shown, getattr(self, name), self.mi.ParamFlags.Differentiable)
        for name, held in self._numbers.items():
            callback.put(name, held, self.mi.ParamFlags.NonDifferentiable)

    def parameters_changed(self, keys: list[str]) -> None:
        """Make the tables anew if one of the numbers behind them changed."""
        if not keys or set(keys) & self._numbers.keys():
            self._prepare()

    def to_string(self) -> str:
        """Its numbers."""
        slopes = self._facets
        return f"ilstd[gamma = {slopes.gamma:g}, sigma = {slopes.sigma}, metal = {self.metal}]"
