"""What theory predicts, labelled like a measurement.

`predict` gives whole lobes by any model: the first order without sampling, all orders by
`walk`. `evaluate` and `evaluate_walk` do so for single directions, and `Brdf` is any of them as
a renderer takes it. `presets` are models of the literature, `UserBrdf` one in their place.
"""

from . import presets
from .brdf import Brdf
from .csv_columns import read_columns
from .directions import direction
from .dispatch import predict
from .random_walk.evaluate import evaluate_walk
from .random_walk.simulate import walk
from .registry import MODELS, Model, Walk, all_orders, of_layers, order_one
from .single_scattering.facets import Masking
from .single_scattering.first_order import evaluate
from .user_brdf.brdf import UserBrdf, examine, has_values
from .user_brdf.load import load as load_user_brdf
from .user_brdf.mitsuba_bsdf import from_mitsuba
from .user_brdf.predict import predict_user_brdf

__all__ = [
    "MODELS",
    "Brdf",
    "Masking",
    "Model",
    "UserBrdf",
    "Walk",
    "all_orders",
    "direction",
    "evaluate",
    "evaluate_walk",
    "examine",
    "from_mitsuba",
    "has_values",
    "load_user_brdf",
    "of_layers",
    "order_one",
    "predict",
    "predict_user_brdf",
    "presets",
    "read_columns",
    "walk",
]
