"""The same with an error each, of the kind one makes; `microsurf validate --model` finds both."""

from .user_brdf import N, body, specular


def no_n_squared(i, o):
    """The body part without its 1/n²."""
    return specular(i, o), N**2 * body(i, o)


def two_for_four(i, o):
    """The specular part with 2 i_z o_z where the Jacobian of the half vector makes it 4."""
    return 2 * specular(i, o), body(i, o)
