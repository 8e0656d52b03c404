"""What the rendered pictures are drawn from."""

from collections import Counter
from itertools import pairwise

import numpy as np

from microsurf.results import detector
from validation.figures import relief, spheres


def lambertian():
    shape = (len(spheres.THETAS), detector.RINGS, detector.SECTORS // 2 + 1)
    return spheres.Table(np.full(shape, 0.5 / np.pi))


def test_a_lambertian_table_is_lambertian():
    table, rng = lambertian(), np.random.default_rng(0)
    normal = np.array([[0.0, 0.6, 0.8]] * 50)
    i, o = (w / np.linalg.norm(w, axis=1)[:, None] for w in rng.standard_normal((2, 50, 3)))
    up = (np.sum(i * normal, axis=1) > 0) & (np.sum(o * normal, axis=1) > 0)
    np.testing.assert_allclose(table.value(i, o, normal), np.where(up, 0.5 / np.pi, 0))
    np.testing.assert_allclose(table.albedo(np.array([1.0, 0.5, 0.0])), 0.5)


def test_the_sphere_is_whole_and_illuminated_as_a_lambertian_one():
    """Towards the lamp its radiance is albedo/π times irradiance, plus the sky's."""
    seen = spheres.view()
    border = np.ones_like(seen.sphere)
    border[1:-1, 1:-1] = False
    assert seen.sphere.any()
    assert not (seen.sphere & border).any()
    picture = spheres.render(lambertian(), seen)
    towards = spheres.LAMP - spheres.CENTRE
    distance = np.linalg.norm(towards)
    facing = np.where(seen.sphere, seen.normals @ towards / distance, -1)
    brightest = np.unravel_index(np.argmax(facing), facing.shape)
    nearer = (distance / (distance - 1)) ** 2
    expected = 0.5 / np.pi * spheres.LAMP_IRRADIANCE * nearer + 0.5 * spheres.SKY
    np.testing.assert_allclose(picture[brightest], expected, rtol=0.02)


def test_walls_close_the_relief_but_for_its_bottom():
    heights = np.random.default_rng(1).standard_normal((5, 7))
    vertices, faces = relief.block(heights)
    edges = Counter(
        frozenset(edge) for face in faces for edge in pairwise([*face.tolist(), face[0]])
    )
    low = vertices[:, 2] < heights.min()
    single = [tuple(edge) for edge, count in edges.items() if count == 1]
    assert set(edges.values()) == {1, 2}
    assert all(low[a] and low[b] for a, b in single)
    np.testing.assert_array_equal(vertices[: heights.size, 2].reshape(5, 7), heights)
