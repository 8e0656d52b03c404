"""What theory predicts, labelled like a measurement.

`predict` and `evaluate` give the first order without sampling, `walk` and
`evaluate_walk` all orders by random walks.
"""

from .predict import NAMES, evaluate, predict
from .walk import KINDS, walk
from .walk_evaluate import evaluate_walk

__all__ = ["KINDS", "NAMES", "evaluate", "evaluate_walk", "predict", "walk"]
