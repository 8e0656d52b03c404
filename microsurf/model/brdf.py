"""What a renderer needs of every model, with one signature: `Brdf`."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..physics import fresnel
from ..scene import Roughness, Scene
from ..scene.layers import refuse
from .directions import checked
from .random_walk.evaluate import evaluate_walk
from .random_walk.parameters import stream
from .random_walk.simulate import MOST_EVENTS, arguments_of
from .registry import MODELS, entry_of, walk_of
from .single_scattering import importance
from .single_scattering.first_order import evaluate

Array = NDArray[np.float64]


class Sample(NamedTuple):
    """Directions and their weights, with which E[weight g(o)] = ∫ f cosθ_o g(o) dω_o.

    o : unit directions, shape (..., 3). weight : shape (...), 0 where no light goes on
    (then o may be anything). delta : whether o is a flat mirror's, which no density has.
    """

    o: Array
    weight: Array
    delta: NDArray[np.bool_]


@dataclass(frozen=True)
class Brdf:
    """A scene's material and roughness by one model: `evaluate`, `sample` and `pdf`.

    Parameters
    ----------
    scene : Scene
        With one Kd; its light and surface are not used.
    model : str
        Any in `model.registry`: of order 1, exact up to quadrature, or of all orders, random;
        of two layers for a scene that has them, and of one surface for any other.
    walks : int
        Walks for each pair of directions in `evaluate`, ≥ 2; of models of all orders only.

    Raises
    ------
    InputError
        If one of these is not as described.

    """

    scene: Scene
    model: str = "smith"
    walks: int = 64

    def __post_init__(self) -> None:
        if entry_of(self.model, MODELS).layered:
            arguments_of(self.scene, self.model)  # refuses what the walk does not know
        else:
            refuse(self.scene.layers, f"the model {self.model}")
        if len(self.scene.material.kd) > 1:
            raise InputError(f"material.kd = {list(self.scene.material.kd)}: must be one number")

    @property
    def stochastic(self) -> bool:
        """Whether `evaluate` is a random estimate, and needs a generator."""
        return MODELS[self.model].walk is not None and self.scene.requires.roughness

    @property
    def _flat(self) -> bool:
        """Whether what the interface mirrors of a beam is one direction."""
        interface = replace(self.scene, layers=None)
        return MODELS[self.model].flat or not interface.requires.roughness

    @property
    def _proposed(self) -> Scene:
        """One surface whose lobes are proposed: smooth for a flat model or interface."""
        interface = replace(self.scene, layers=None)
        return replace(interface, roughness=Roughness(sigma=(0.0,))) if self._flat else interface

    def evaluate(
        self, i: Array, o: Array, rng: np.random.Generator | None = None
    ) -> tuple[Array, Array]:
        """BRDF in sr⁻¹, cosine not included: f_specular and f_body, see `predict.evaluate`.

        A walk's values are unbiased estimates drawn with ``rng``, see `evaluate_walk`. What a plane
        mirrors, a delta, is left out of all.
        """
        if not self.stochastic:
            return evaluate(self.scene, i, o, "flat" if self._flat else self.model)
        if rng is None:
            raise InputError(f"model = {self.model!r}: its values are random; give rng")
        mean, _ = evaluate_walk(self.scene, i, o, self.model, self.walks, rng)
        return mean.specular, mean.body

    def sample(self, i: Array, rng: np.random.Generator) -> Sample:
        """Draw one direction of reflected light for each unit vector i, shape (..., 3), i_z > 0.

        Order-1 models draw from `pdf` and weigh by f cosθ_o/pdf. Walks are walked: the
        weight is what the substrate leaves, never above 1, and needs no density.
        """
        (i,) = checked(i=i)
        if not np.all(i[..., 2] > 0):
            raise InputError("i: must point above the horizon to sample")
        if self.stochastic:
            return self._walked(i, rng)
        scene = self._proposed
        drawn = importance.sample(scene, i, rng, several=False)
        specular, body = self.evaluate(i, drawn.o)
        density = self.pdf(i, drawn.o)
        valued = (density > 0) & ~drawn.delta
        weight = np.zeros(i.shape[:-1])
        weight[valued] = ((specular + body) * drawn.o[..., 2])[valued] / density[valued]
        if drawn.delta.any():
            material, share = scene.material, importance.mirrored_share(scene, i, several=False)
            mirror = fresnel.reflectance(i[..., 2], material.n, material.k)
            weight[drawn.delta] = (mirror / np.maximum(share, np.finfo(float).tiny))[drawn.delta]
        return Sample(drawn.o, weight, drawn.delta)

    def _walked(self, i: Array, rng: np.random.Generator) -> Sample:
        most = MOST_EVENTS if self.scene.requires.multiple_scattering else 1
        run, arguments = walk_of(self.model).simulate, arguments_of(self.scene, self.model)
        state = stream(rng)
        flat_i = np.ascontiguousarray(i.reshape(-1, 3))
        exits, events = arguments.paths(len(flat_i))
        for k, w in enumerate(flat_i):
            one = slice(k, k + 1)
            run(exits[one], events[one], most, w, arguments.slopes, arguments.facets, state)
        # A plane over another layer mirrors what was never inside; other walks know no plane.
        mirrored = (events[:, 1] == 0) & self._flat
        shape = i.shape[:-1]
        weight = arguments.weights(exits, events).reshape(shape)
        return Sample(exits[:, :3].reshape(i.shape), weight, mirrored.reshape(shape))

    def pdf(self, i: Array, o: Array) -> Array:
        """Density in sr⁻¹ that proposes o from i; see `importance`.

        For order-1 models that of `sample`, exactly. A walk's own density is unknown;
        this one, of a lobe close to it, is for multiple importance sampling: the
        estimate is unbiased with any such density, its variance shows how close.
        """
        i, o = checked(i=i, o=o)
        return importance.density(self._proposed, i, o, several=self.stochastic)
