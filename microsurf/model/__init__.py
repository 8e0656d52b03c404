"""What theory predicts, labelled like a measurement: `predict` and `evaluate`."""

from .predict import NAMES, evaluate, predict

__all__ = ["NAMES", "evaluate", "predict"]
