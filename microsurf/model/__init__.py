"""What theory predicts, labelled like a measurement.

`predict` and `evaluate` give the first order without sampling, `walk` and
`evaluate_walk` all orders by random walks. `Brdf` is any of them as a renderer takes
it, `named` the models of the literature. `Candidate` is a BRDF of one's own in their place.
"""

from . import named
from .brdf import Brdf
from .candidate import Candidate, examine, has_values
from .candidate import load as load_candidate
from .candidate_predict import predict_candidate
from .directions import direction
from .predict import NAMES, evaluate, predict
from .walk import KINDS, walk
from .walk_evaluate import evaluate_walk

__all__ = [
    "KINDS",
    "NAMES",
    "Brdf",
    "Candidate",
    "direction",
    "evaluate",
    "evaluate_walk",
    "examine",
    "has_values",
    "load_candidate",
    "named",
    "predict",
    "predict_candidate",
    "walk",
]
