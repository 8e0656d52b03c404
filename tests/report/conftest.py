"""Pictures that tests draw are in matplotlib's own style, whatever a matplotlibrc asks for."""

import matplotlib as mpl

mpl.rcdefaults()
