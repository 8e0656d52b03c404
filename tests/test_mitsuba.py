"""The plug-in ``ilstd``: its sampling by Mitsuba's own chi² test, its values by `predict`'s."""

import sys
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import microsurf
from microsurf import mitsuba, model
from microsurf.errors import InputError
from microsurf.scene import Material, Roughness, Scene

SCENE = Scene(material=Material(1.5, (0.8,)), roughness=Roughness(2.0, (0.4,)))
METAL = replace(SCENE, material=Material(0.21, k=3.27))
GAMMAS = (1.7, 2.0, 8.0, 1e4)
THETAS = (0, 30, 60, 80)
SIGMAS = ((0.4, 0.4), (0.5, 0.05))
SAMPLES, SINGLE_SAMPLES = 500_000, 40_000
"""Of a chi² test: the scalar variants are hundreds of times slower."""


def plugin(variant):
    """Mitsuba with the plug-in in a variant; skips where it has none."""
    mi = pytest.importorskip("mitsuba")
    try:
        mi.set_variant(variant)
        compiled = not variant.startswith("scalar")
        if compiled and sys.modules["drjit"].detail.llvm_version()[0] < 19:
            pytest.skip("an LLVM that aborts the process")
    except ImportError:
        pytest.skip("no LLVM")
    mitsuba.register()
    return mi


@pytest.fixture
def compiled():
    yield plugin("llvm_ad_rgb")
    sys.modules["mitsuba"].set_variant("scalar_rgb")


@pytest.fixture
def scalar():
    return plugin("scalar_rgb")


def given(scene):
    rough = scene.roughness
    found = {
        "type": "ilstd",
        "gamma": rough.gamma,
        "sigma_u": rough.sigma_x,
        "sigma_v": rough.sigma_y,
    }
    if scene.material.conductor:
        return found | {"eta": scene.material.n, "k": scene.material.k}
    return found | {"int_ior": scene.material.n, "diffuse_reflectance": scene.material.kd[0]}


def off(mi, scene, count, seed=1):
    """Relative errors of its values against `predict`'s, flux-carrying pairs of directions."""
    rng = np.random.default_rng(seed)
    theta = np.arcsin(np.sqrt(rng.uniform(0, 0.99, (2, count))))
    i, o = model.direction(theta, rng.uniform(0, 2 * np.pi, (2, count)))
    found = microsurf.from_mitsuba(mi.load_dict(given(scene))).evaluate(i, o, scene)
    known = dict(zip(("specular", "body"), model.Brdf(scene, "smith").evaluate(i, o), strict=True))
    total = sum(found.values()), sum(known.values())
    lobes = [(found["specular"], known["specular"]), total]
    return [np.abs(a - b) / np.maximum(b, 1e-6) for a, b in lobes]


@pytest.mark.parametrize(
    "scene", [SCENE, METAL, replace(METAL, roughness=Roughness(1.7, SIGMAS[1]))]
)
def test_its_values_are_those_of_predict(scalar, scene):
    specular, total = off(scalar, scene, 1500)
    assert np.quantile(specular, 0.99) < 1e-4
    assert np.median(total) < 1e-3
    assert np.quantile(total, 0.99) < 0.03


@pytest.mark.long
@pytest.mark.parametrize(("gamma", "sigma"), list(product(GAMMAS, SIGMAS)))
def test_its_values_are_those_of_predict_on_20_000_pairs(compiled, gamma, sigma):
    specular, total = off(compiled, replace(SCENE, roughness=Roughness(gamma, sigma)), 20_000)
    assert np.quantile(specular, 0.99) < 1e-4
    assert np.median(total) <= 1e-3
    assert np.quantile(total, 0.99) <= 0.03


def drawn_one_by_one(mi, values, theta):
    """`sample` of the scalar variant as Mitsuba's test calls it, which has arrays."""

    def sample(numbers):
        rows = np.array(numbers, np.float64).T.tolist()
        with mi.util.variant_context("scalar_rgb"):
            mitsuba.register()
            bsdf, context = mi.load_dict(values), mi.BSDFContext()
            point = mi.SurfaceInteraction3f()
            point.wi = mi.Vector3f(*model.direction(np.radians(theta), 0.5).tolist())
            draws = [bsdf.sample(context, point, u, mi.Point2f(v, w)) for u, v, w in rows]
            towards = np.array([list(one.wo) for one, _ in draws], np.float32)
            used = np.array([weight[0] > 0 for _, weight in draws], np.float32)
        return mi.Vector3f(*towards.T), mi.Float(used)

    return sample


def p_value(mi, scene, theta, seed, drawn=1.0, orders="1", single=False):
    """Of Mitsuba's test of `sample` against `pdf`; ``drawn`` times the roughness is sampled.

    ``single``: by the scalar variant, against the compiled one's `pdf`.
    """
    from mitsuba.chi2 import BSDFAdapter, ChiSquareTest, SphericalDomain  # noqa: PLC0415

    def functions(of):
        xml = "".join(
            f'<float name="{key}" value="{value}"/>'
            if key not in {"eta", "k", "diffuse_reflectance"}
            else f'<spectrum name="{key}" value="{value}"/>'
            for key, value in given(of).items()
            if key != "type"
        )
        xml += f'<string name="orders" value="{orders}"/>'
        w = mi.ScalarVector3f(*model.direction(np.radians(theta), 0.5).tolist())
        return BSDFAdapter("ilstd", xml, wi=w)

    rough = scene.roughness
    other = replace(rough, sigma=tuple(drawn * s for s in rough.sigma))
    sampled = replace(scene, roughness=other)
    sample, _ = functions(sampled)
    if single:
        sample = drawn_one_by_one(mi, given(sampled) | {"orders": orders}, theta)
    _, pdf = functions(scene)
    count = SINGLE_SAMPLES if single else SAMPLES
    test = ChiSquareTest(
        SphericalDomain(), sample, pdf, 3, sample_count=count, res=101, ires=16, seed=seed
    )
    test.run(0.01, 1, quiet=True)
    return test.p_value


SHORT = [
    (replace(SCENE, roughness=Roughness(1.7, (0.4,))), 60),
    (replace(METAL, roughness=Roughness(8.0, (0.4,))), 30),
    (replace(METAL, roughness=Roughness(2.0, SIGMAS[1])), 80),
    (replace(METAL, roughness=Roughness(1e4, SIGMAS[1])), 0),
]


def test_mitsubas_chi_square_test_passes(compiled, judge):
    judge.keeps([p_value(compiled, *one, judge.seed(k)) for k, one in enumerate(SHORT)])


@pytest.mark.long
def test_mitsubas_chi_square_test_passes_everywhere(compiled, judge):
    cases = [
        (replace(scene, roughness=Roughness(gamma, sigma)), theta)
        for scene, gamma, sigma, theta in product((SCENE, METAL), GAMMAS, SIGMAS, THETAS)
    ]
    judge.keeps([p_value(compiled, *one, judge.seed(k)) for k, one in enumerate(cases)])


def test_a_roughness_3_per_cent_off_is_rejected(compiled, judge):
    judge.catches(p_value(compiled, METAL, 30, judge.seed(9), drawn=1.03))


@pytest.mark.long
@pytest.mark.parametrize("single", [False, True])
def test_mitsubas_chi_square_test_passes_for_all_orders(compiled, judge, single):
    thetas = dict(zip(GAMMAS, THETAS[::-1], strict=True))
    cases = product(GAMMAS, THETAS) if not single else thetas.items()
    judge.keeps(
        [
            p_value(
                compiled, replace(SCENE, roughness=Roughness(gamma, (0.4,))), theta,
                judge.seed(k), orders="all", single=single,
            )
            for k, (gamma, theta) in enumerate(cases)
        ]
    )  # fmt: skip


@pytest.mark.long
def test_mitsubas_chi_square_test_passes_everywhere_in_a_scalar_variant(compiled, judge):
    cases = [
        (replace(scene, roughness=Roughness(gamma, sigma)), theta)
        for (gamma, scene), sigma, theta in product(
            zip(GAMMAS, (SCENE, METAL) * 2, strict=True), SIGMAS, THETAS
        )
    ]
    judge.keeps(
        [p_value(compiled, *one, judge.seed(k), single=True) for k, one in enumerate(cases)]
    )


def test_another_roughness_is_rejected_in_a_scalar_variant(compiled, judge):
    judge.catches(p_value(compiled, METAL, 30, judge.seed(9), drawn=1.2, single=True))


def reflected(mi, gamma, sigma, theta, orders):
    """Albedo at Kd = 1, by the midpoint rule over half the hemisphere."""
    lit = Scene(material=Material(1.5, (1.0,)), roughness=Roughness(gamma, (sigma,)))
    bsdf = mi.load_dict(given(lit) | {"orders": orders})
    polar, turn = (np.arange(800) + 0.5) / 800 * np.pi / 2, (np.arange(400) + 0.5) / 400 * np.pi
    o = model.direction(*np.meshgrid(polar, turn, indexing="ij"))
    point = mi.SurfaceInteraction3f()
    point.wi = mi.Vector3f(*model.direction(np.radians(theta), 0.0).tolist())
    value = bsdf.eval(mi.BSDFContext(), point, mi.Vector3f(*o.reshape(-1, 3).T.astype(np.float32)))
    rings = np.array(value[0]).reshape(800, 400).sum(axis=1) * np.sin(polar)
    return rings.sum() * 2 * (np.pi / 2 / 800) * (np.pi / 400)


@pytest.mark.long
@pytest.mark.parametrize(("gamma", "sigma"), list(product(GAMMAS, (0.3, 0.5))))
def test_all_orders_lose_nothing_in_a_white_furnace(compiled, gamma, sigma):
    for theta in THETAS:
        assert abs(reflected(compiled, gamma, sigma, theta, "all") - 1) < 0.005


def test_one_order_loses_light_in_a_white_furnace_and_all_do_not(compiled):
    assert abs(reflected(compiled, 2.0, 0.5, 60, "all") - 1) < 0.005
    assert reflected(compiled, 2.0, 0.5, 60, "1") < 0.98


def test_all_orders_are_reciprocal_and_drawn_as_they_say(compiled, judge):
    bsdf = compiled.load_dict(given(SCENE) | {"orders": "all"})
    i, o = model.direction(np.array([0.3, 1.2]), np.array([0.1, 4.0]))
    point, context, values = compiled.SurfaceInteraction3f(), compiled.BSDFContext(), []
    for one, other in ((i, o), (o, i)):
        point.wi = compiled.Vector3f(*one.tolist())
        value = bsdf.eval(context, point, compiled.Vector3f(*other.tolist()))
        values.append(value[0][0] / other[2])
    np.testing.assert_allclose(*values, rtol=1e-4)
    judge.keeps([p_value(compiled, SCENE, 60, judge.seed(20), orders="all")])


def test_both_kinds_of_variants_give_the_same(compiled):
    i, o = model.direction(np.array([0.3, 1.2]), np.array([0.1, 4.0]))
    pairs = np.stack([i, o]), np.stack([o, i])
    one = microsurf.from_mitsuba(compiled.load_dict(given(SCENE))).evaluate(*pairs, SCENE)
    other = microsurf.from_mitsuba(plugin("scalar_rgb").load_dict(given(SCENE)))
    for kind, values in other.evaluate(*pairs, SCENE).items():
        np.testing.assert_allclose(one[kind], values, rtol=1e-4)


def test_flags_components_textures_and_both_sides(scalar):
    kind = scalar.BSDFFlags
    bsdf = scalar.load_dict(given(SCENE))
    assert [bsdf.flags(k) for k in range(bsdf.component_count())] == [
        int(kind.GlossyReflection) | int(kind.FrontSide),
        int(kind.DiffuseReflection) | int(kind.FrontSide),
    ]
    laid = scalar.load_dict(given(replace(METAL, roughness=Roughness(2.0, (0.3, 0.1)))))
    assert laid.component_count() == 1
    assert laid.flags() & int(kind.Anisotropic)
    assert "diffuse_reflectance.value" in str(scalar.traverse(bsdf))
    assert "int_ior" in str(scalar.traverse(bsdf))
    assert "eta.value" in str(scalar.traverse(laid))
    both = scalar.load_dict({"type": "twosided", "bsdf": given(SCENE)})
    point, context = scalar.SurfaceInteraction3f(), scalar.BSDFContext()
    up, down = (scalar.Vector3f(0.3, 0.0, z) for z in (0.954, -0.954))
    values = []
    for of, (wi, wo) in ((bsdf, (up, up)), (both, (up, up)), (both, (down, down))):
        point.wi = wi
        values.append(of.eval(context, point, wo)[0])
    assert values[0] > 0
    np.testing.assert_allclose(values, values[0])
    point.wi = down
    assert bsdf.eval(context, point, down)[0] == 0


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"gamma": 1.5}, "roughness.gamma"),
        ({"sigma": 0.0}, "must be > 0"),
        ({"sigma_u": -0.1}, "roughness.sigma"),
        ({"int_ior": 0.5}, "material.n"),
        ({"alpha": 0.3}, "alpha"),
        ({"orders": "2"}, "must be .1. or .all."),
        ({"orders": "all", "sigma_v": 0.1}, "only for one sigma"),
        ({"orders": "all", "eta": 0.2, "k": 3.0}, "not for conductors"),
    ],
)
def test_what_it_cannot_be_is_refused(scalar, wrong, words):
    with pytest.raises(Exception, match=words):
        scalar.load_dict({"type": "ilstd", **wrong})


@pytest.mark.parametrize("scene", [METAL, replace(METAL, roughness=Roughness(2.0, SIGMAS[1]))])
def test_numbers_can_be_changed_after_it_was_made(scalar, scene):
    bsdf = scalar.load_dict(given(METAL))
    params = scalar.traverse(bsdf)
    assert {"gamma", "sigma_u", "sigma_v"} <= set(params.keys())
    rough = Roughness(3.0, scene.roughness.sigma)
    i, o = model.direction(np.array([0.3, 1.2]), np.array([0.1, 4.0]))
    pairs = np.stack([i, o]), np.stack([o, i])
    before, expected = (
        microsurf.from_mitsuba(scalar.load_dict(given(replace(METAL, roughness=each)))).evaluate(
            *pairs, METAL
        )["specular"]
        for each in (METAL.roughness, rough)
    )
    params["gamma"], params["sigma_v"] = rough.gamma, rough.sigma_y
    params["sigma_u"] = rough.sigma_x
    params.update()
    after = microsurf.from_mitsuba(bsdf).evaluate(*pairs, METAL)["specular"]
    np.testing.assert_allclose(after, expected, rtol=1e-5)
    assert np.abs(after / before - 1).max() > 0.01
    assert bool(bsdf.flags() & int(scalar.BSDFFlags.Anisotropic)) is not rough.isotropic
    params["gamma"] = 1.0
    with pytest.raises(InputError, match=r"roughness\.gamma"):
        params.update()


def test_an_old_llvm_is_refused_before_it_ends_the_process(compiled, monkeypatch):
    detail = sys.modules["drjit"].detail
    monkeypatch.setattr(detail, "llvm_version", lambda: (15, 0, 6))
    with pytest.raises(InputError, match=r"by LLVM 15, .*DRJIT_LIBLLVM_PATH.* scalar_rgb$"):
        mitsuba.register()
    compiled.set_variant("scalar_rgb")
    mitsuba.register()


def test_without_mitsuba_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(InputError, match=r"mitsuba is not installed: .*microsurf\[mitsuba\]"):
        mitsuba.register()
