"""BSDFs of Mitsuba as user BRDFs, against closed forms and our own first order."""

import sys
from dataclasses import replace

import numpy as np
import pytest

import microsurf
from microsurf import model
from microsurf.errors import InputError
from microsurf.model import examine, load_user_brdf, predict_user_brdf
from microsurf.physics import fresnel
from microsurf.results import detector
from microsurf.scene import Light, Material, Roughness, Scene, Surface

SCENE = Scene(
    material=Material(1.5, (0.8,)), roughness=Roughness(2.0, (0.3,)), light=Light((40.0,))
)
METAL = replace(SCENE, material=Material(0.2, k=3.9))
LAID = Roughness(2.0, (0.2, 0.6))
ROUGH = replace(SCENE, material=Material(1.0, (0.6,)))


def test_without_mitsuba_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(InputError, match=r"^mitsuba is not installed: .*microsurf\[mitsuba\]"):
        load_user_brdf("mitsuba:diffuse")
    with pytest.raises(InputError, match="mitsuba is not installed"):
        microsurf.from_mitsuba(object())


@pytest.fixture
def mi():
    module = pytest.importorskip("mitsuba")
    module.set_variant("scalar_rgb")
    return module


def pairs(count=500, seed=1):
    rng = np.random.default_rng(seed)
    theta = np.arcsin(np.sqrt(rng.uniform(0, 0.98, (2, count))))
    return model.direction(theta, rng.uniform(0, 2 * np.pi, (2, count)))


def values(name, scene):
    i, o = pairs()
    return load_user_brdf(f"mitsuba:{name}").evaluate(i, o, scene)


@pytest.mark.usefixtures("mi")
def test_diffuse_is_kd_over_pi():
    found = values("diffuse", ROUGH)
    np.testing.assert_allclose(found["body"], 0.6 / np.pi, rtol=1e-5)
    assert not found["specular"].any()
    # Where there is an interface, the one component is all that the material has.
    (whole,) = values("diffuse,reflectance=0.25", SCENE).values()
    np.testing.assert_allclose(whole, 0.25 / np.pi, rtol=1e-5)


@pytest.mark.usefixtures("mi")
@pytest.mark.parametrize(
    ("roughness", "allowed"),
    [
        (Roughness(2.0, (0.3,)), 2e-4),
        (LAID, 2e-4),
        # Mitsuba takes Beckmann's Λ from a rational fit, good to 0.4 % [W07].
        (Roughness(1e9, (0.3,)), 8e-3),
    ],
)
def test_roughconductor_is_our_first_order_with_separable_masking(roughness, allowed):
    scene = replace(METAL, roughness=roughness)
    found = values("roughconductor", scene)
    i, o = pairs()
    ours = model.Brdf(scene, "smith-separable").evaluate(i, o)[0]
    np.testing.assert_allclose(found["specular"], ours, rtol=allowed, atol=1e-6)
    assert not found["body"].any()


@pytest.mark.usefixtures("mi")
def test_roughplastic_has_our_specular_lobe_and_its_own_body():
    found = values("roughplastic,nonlinear=true", SCENE)
    i, o = pairs()
    specular, body = model.Brdf(SCENE, "smith-separable").evaluate(i, o)
    np.testing.assert_allclose(found["specular"], specular, rtol=2e-4, atol=1e-6)
    assert np.median(found["body"] / body) < 0.95


@pytest.mark.usefixtures("mi")
def test_our_plug_in_needs_no_registering():
    steep = replace(METAL, roughness=Roughness(3.0, (0.2, 0.6)))
    brdf = load_user_brdf("mitsuba:ilstd")
    i, o = pairs()
    ours = model.Brdf(steep, "smith").evaluate(i, o)[0]
    np.testing.assert_allclose(brdf.evaluate(i, o, steep)["specular"], ours, rtol=1e-3, atol=1e-6)
    assert "gamma = 3, sigma_u = 0.2, sigma_v = 0.6" in brdf.remarks(steep)[0]


@pytest.mark.usefixtures("mi")
def test_a_component_that_cannot_be_asked_for_alone_is_not_split():
    assert list(values("principled", SCENE)) == ["all"]
    assert list(values("roughconductor", SCENE)) == ["all"]  # the scene has a substrate


@pytest.mark.usefixtures("mi")
def test_a_mirror_goes_into_its_bin_and_is_told():
    brdf = load_user_brdf("mitsuba:plastic,nonlinear=true")
    predicted = predict_user_brdf(brdf, SCENE)
    assert predicted.attrs["orders"] == "1 and all"
    specular = predicted.flux[0, 0, 0, 0, 0].values
    ring, sector = np.unravel_index(specular.argmax(), specular.shape)
    assert (ring, sector) == (detector.ring_of(40.0), detector.SECTORS // 2)
    reflectance = float(fresnel.reflectance(np.cos(np.radians(40)), 1.5))
    assert specular.sum() == pytest.approx(reflectance, rel=1e-5)
    flat = model.predict(replace(SCENE, roughness=Roughness(sigma=(0.0,))), "flat")
    ours, theirs = (d.microsurf.albedo(order=1, kind="body").item() for d in (flat, predicted))
    assert theirs == pytest.approx(ours, rel=2e-3)  # its r_i is a fit
    filled, mirror = brdf.remarks(SCENE)
    assert "int_ior = 1.5, ext_ior = 1, diffuse_reflectance = 0.8;" in filled
    assert "Dirac" in mirror


@pytest.mark.usefixtures("mi")
@pytest.mark.parametrize(
    ("name", "scene", "filled"),
    [
        ("roughplastic", SCENE, "distribution = ggx, alpha = 0.3"),
        ("roughplastic", replace(SCENE, roughness=Roughness(1e9, (0.3,))), "= beckmann"),
        ("roughplastic,alpha=0.5", SCENE, "diffuse_reflectance = 0.8, distribution = ggx;"),
        ("roughconductor", METAL, "eta = 0.2, k = 3.9, distribution = ggx, alpha = 0.3"),
        (
            "roughconductor,alpha=0.2",
            replace(METAL, roughness=LAID),
            "= ggx;",
        ),
        ("principled", SCENE, "base_color = 0.8, eta = 1.5, roughness = 0.547723"),
        ("principled", METAL, "metallic = 1, base_color = 0.951952"),
        ("principled,specular=0.5", SCENE, "gives base_color = 0.8, roughness = 0.547723"),
        ("diffuse,reflectance=0.1", SCENE, "none of its parameters"),
    ],
)
def test_what_the_scene_gives_is_filled_in_and_told(name, scene, filled):
    brdf = load_user_brdf(f"mitsuba:{name}")
    assert examine(brdf, scene) == []
    assert filled in brdf.remarks(scene)[0]


@pytest.mark.usefixtures("mi")
@pytest.mark.parametrize(
    ("name", "scene", "words"),
    [
        ("nonsense", SCENE, '"nonsense" not found'),
        ("sphere", SCENE, "not a BSDF"),
        ("roughplastic,alhpa=0.3", SCENE, "alhpa"),
        ("roughplastic,alpha", SCENE, "KEY=VALUE"),
        ("roughplastic,distribution=phong", SCENE, "phong"),
        ("roughplastic", replace(SCENE, roughness=Roughness(8.0)), "neither GGX"),
        ("roughplastic", replace(SCENE, roughness=LAID), "anisotropic"),
        ("roughplastic", replace(SCENE, surface=Surface(file="a.npy")), "is a file's"),
        ("principled", replace(SCENE, roughness=Roughness(1e9)), "has GGX slopes"),
        ("roughdielectric", SCENE, "transmits"),
        ("roughconductor,material=Cu", METAL, "is coloured"),
        ("roughplastic", ROUGH, "indices of refraction"),
    ],
)
def test_what_cannot_be_judged_is_refused_in_one_line(name, scene, words):
    with pytest.raises(InputError) as caught:
        examine(load_user_brdf(f"mitsuba:{name}"), scene)
    text = str(caught.value)
    assert words in text
    assert f"mitsuba:{name}" in text
    assert "\n" not in text


def test_from_python_a_channel_is_chosen(mi):
    copper = mi.load_dict({"type": "roughconductor", "material": "Cu"})
    i, o = pairs(20)
    red, blue = (
        microsurf.from_mitsuba(copper, channel=k).evaluate(i, o, METAL)["specular"] for k in (0, 2)
    )
    assert red.sum() > blue.sum()
    with pytest.raises(InputError, match="is coloured"):
        microsurf.from_mitsuba(copper)
    with pytest.raises(InputError, match=r"channel = 3: must be 0 … 2"):
        microsurf.from_mitsuba(copper, channel=3)
    with pytest.raises(InputError, match="not a BSDF"):
        microsurf.from_mitsuba(3)


def test_variants_that_are_compiled_give_the_same(mi):
    try:
        mi.set_variant("llvm_ad_rgb")
        version = sys.modules["drjit"].detail.llvm_version()
    except ImportError:
        pytest.skip("no LLVM")
    if version[0] < 19:
        pytest.skip("an LLVM that aborts the process")
    bsdf = mi.load_dict({"type": "plastic", "int_ior": 1.5, "ext_ior": 1.0})
    compiled = microsurf.from_mitsuba(bsdf)
    mi.set_variant("scalar_rgb")
    i, o = pairs()
    # Each is asked in its own variant, whichever is set.
    found = compiled.evaluate(i, o, SCENE)["body"]
    given = "plastic,diffuse_reflectance=0.5"
    np.testing.assert_allclose(found, values(given, SCENE)["body"], rtol=1e-4)
    assert compiled.mirror(i[0], SCENE) == pytest.approx(
        load_user_brdf(f"mitsuba:{given}").mirror(i[0], SCENE), rel=1e-4
    )
