"""What theory predicts, labelled like a measurement.

`predict` and `evaluate` give the first order without sampling, `walk` and
`evaluate_walk` all orders by random walks. `Brdf` is any of them as a renderer takes
it, `named` the models of the literature.
"""

from . import named
from .brdf import Brdf
from .directions import direction
from .predict import NAMES, evaluate, predict
from .walk import KINDS, walk
from .walk_evaluate import evaluate_walk

__all__ = [
    "KINDS",
    "NAMES",
    "Brdf",
    "direction",
    "evaluate",
    "evaluate_walk",
    "named",
    "predict",
    "walk",
]
