"""What theory predicts, labelled like a measurement.

`predict` and `evaluate` give the first order without sampling, `walk` and
`evaluate_walk` all orders by random walks. `Brdf` is any of them as a renderer takes
it, `presets` the models of the literature. `UserBrdf` is a user BRDF in their place.
"""

from . import presets
from .brdf import Brdf
from .csv_columns import read_columns
from .directions import direction
from .random_walk.evaluate import evaluate_walk
from .random_walk.simulate import walk
from .registry import MODELS, Model, Walk, all_orders, of_layers, order_one
from .single_scattering.facets import Masking
from .single_scattering.first_order import evaluate, predict
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
