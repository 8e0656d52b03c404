"""What a result says of itself: ``result.microsurf.albedo(order=1, kind="specular")``.

A result, measured or predicted, carries its scene: its material is that of the scene unless
another is given. Paths are traced without a substrate's albedo, so that a result answers for
every Kd; of a scene with several, one must be named.
"""

from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..errors import InputError
from ..scene import Scene, notebook
from . import datasets, detector

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_scene_of = lru_cache(64)(Scene.from_toml)


@xr.register_dataset_accessor("microsurf")  # type: ignore[no-untyped-call]
class Result:
    """Figures of one result by realisation, theta_i and phi_i.

    Of all methods: ``order`` is 1, 2, 3 or 4 (four facets or more), None for all of them
    together; ``kind`` "specular" or "body", None for both together; ``kd`` in [0, 1] and ``n`` as
    in `Material`, those of the result's scene by default.
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    @property
    def scene(self) -> Scene:
        """The scene it was found for.

        Raises
        ------
        InputError
            If the result does not say.

        """
        if "scene" not in self._dataset.attrs:
            raise InputError("this result carries no scene: give n and kd")
        return _scene_of(self._dataset.attrs["scene"])

    def _material(self, n: float | None, kd: float | None) -> tuple[float, float]:
        if n is None:
            n = self.scene.material.n
        if kd is None:
            if len(self.scene.material.kd) > 1:
                listed = ", ".join(f"{value:g}" for value in self.scene.material.kd)
                raise InputError(f"kd is not given: the scene has {listed}; name one")
            kd = self.scene.material.kd[0]
        return n, kd

    def albedo_by_order(self, *, kd: float | None = None, n: float | None = None) -> xr.DataArray:
        """Albedo by order (1, 2, 3, 4+) and kind besides."""
        flux = datasets.hemispherical(self._dataset.flux)
        energy = datasets.by_kind(flux, *self._material(n, kd))
        return energy.reindex(order=list(detector.ORDERS), fill_value=0.0)

    def albedo(
        self,
        order: int | None = None,
        kind: str | None = None,
        *,
        kd: float | None = None,
        n: float | None = None,
    ) -> xr.DataArray:
        """Part of the incident power that arrives."""
        return _chosen(self.albedo_by_order(kd=kd, n=n), order, kind)

    def ray_error(
        self,
        order: int | None = None,
        kind: str | None = None,
        *,
        kd: float | None = None,
        n: float | None = None,
    ) -> xr.DataArray:
        """Standard error of `albedo` in each realisation from its number of rays alone.

        From the spread of batches that know nothing of each other, where the result has
        them. Else paths are independent draws of a weight w^b, and their counts hold the
        variance.
        """
        material = self._material(n, kd)
        if "batch_flux" in self._dataset:
            return self._batch_error(order, kind, *material)
        squared = self._second_moment(order, kind, *material)
        mean = self.albedo(order, kind, n=material[0], kd=material[1])
        variance = (squared - mean**2).clip(min=0)
        if "paths" not in self._dataset:
            return variance * 0
        return xr.DataArray(np.sqrt(variance / self._dataset.paths))

    def _batch_error(
        self, order: int | None, kind: str | None, n: float, kd: float
    ) -> xr.DataArray:
        """Ratio of sums over batches of light that arrived and light that was sent."""
        light = self._dataset.batch_light
        arrived = _chosen(datasets.by_kind(self._dataset.batch_flux, n, kd), order, kind)
        sent = light.sum("batch")
        rest = arrived - light * (arrived.sum("batch") / sent)
        batches = (light > 0).sum("batch")
        # One batch knows nothing of its error: the most that light between 0 and 1 can have.
        known = (rest**2).sum("batch") * batches / (batches - 1).clip(min=1)
        return xr.DataArray(np.sqrt(known) / sent).where(batches > 1, 0.5)

    def _second_moment(
        self, order: int | None, kind: str | None, n: float, kd: float
    ) -> xr.DataArray:
        weights = datasets.bin_weights(self._dataset, n, kd) ** 2
        flux = datasets.hemispherical(self._dataset.flux)
        squares: xr.DataArray = flux * flux.path_weight * weights
        if order is None and kind is None:
            return squares.sum(("order", "body_events"))
        squares = squares.sum("order") if order is None else squares.sel(order=order, drop=True)
        if kind == "specular":
            return squares.isel(body_events=0, drop=True)
        return squares.isel(body_events=slice(int(kind == "body"), None)).sum("body_events")

    def standard_error(
        self,
        order: int | None = None,
        kind: str | None = None,
        *,
        kd: float | None = None,
        n: float | None = None,
    ) -> xr.DataArray:
        """Error of `albedo`'s mean over realisations; of the rays alone if there is only one."""
        count = self._dataset.sizes["realisation"]
        if count == 1:
            return self.ray_error(order, kind, kd=kd, n=n).isel(realisation=0, drop=True)
        spread = self.albedo(order, kind, kd=kd, n=n).std("realisation", ddof=1)
        return xr.DataArray(spread / np.sqrt(count))

    def lobe(
        self,
        order: int | None = 1,
        kind: str | None = None,
        *,
        kd: float | None = None,
        n: float | None = None,
    ) -> xr.DataArray:
        """Part of the incident power in each bin, by theta_o and phi_o besides."""
        flux = self._dataset.flux
        if order is not None:  # before the sums over body events, which are most of the work
            flux = flux.sel(order=order, drop=True)
        return _chosen(datasets.by_kind(flux, *self._material(n, kd)), None, kind)

    def lobe_ray_variance(
        self, kind: str, *, kd: float | None = None, n: float | None = None
    ) -> xr.DataArray:
        """Variance of an order-1 lobe's bins in each realisation from its rays alone."""
        n, kd = self._material(n, kd)
        weight = 1.0
        if kind != "specular":
            weight = float(datasets.bin_weights(self._dataset.flux, n, kd)[1:2].sum())
        return xr.DataArray(self._dataset.bin_variance.sel(kind=kind, drop=True) * weight**2)

    def lobe_error(
        self, kind: str, *, kd: float | None = None, n: float | None = None
    ) -> xr.DataArray:
        """Error of an order-1 lobe's mean over realisations, of its rays if there is one.

        Relative to the lobe itself: root of the sums of squares over its bins.
        """
        values = self.lobe(1, kind, kd=kd, n=n)
        count = self._dataset.sizes["realisation"]
        if count == 1:
            variance = self.lobe_ray_variance(kind, kd=kd, n=n).isel(realisation=0, drop=True)
        else:
            variance = values.var("realisation", ddof=1) / count
        bins = ("theta_o", "phi_o")
        size = (values.mean("realisation") ** 2).sum(bins)
        return xr.DataArray(np.sqrt(variance.sum(bins) / size)).fillna(0.0)

    def region_ray_error(
        self,
        kind: str,
        region: NDArray[np.bool_],
        *,
        kd: float | None = None,
        n: float | None = None,
    ) -> xr.DataArray:
        """Standard error of an order-1 lobe's light in a region, in each realisation; a bound.

        From the rays alone. ``region`` says which bins it has, shape (theta_o, phi_o). A mirrored
        ray ends in one bin: variances add up. A fan of body light fills one sector: along it
        errors add up, as if its rings always went together.
        """
        bins = self.lobe_ray_variance(kind, kd=kd, n=n)
        mirrored = bins.roll(phi_o=-1).isel(phi_o=slice(None, None, -1))
        # Folded lobes hold half of every ray at φ and half at −φ: the sum of both is the ray.
        twice = 1 + bool(np.allclose(bins.values, mirrored.values, rtol=1e-9, atol=0))
        inside = bins.where(xr.DataArray(region, dims=("theta_o", "phi_o")), 0.0)
        if kind == "specular":
            sectors = inside.sum("theta_o")
        else:
            sectors = xr.DataArray(np.sqrt(inside)).sum("theta_o") ** 2
        total = sectors.sum("phi_o").transpose("realisation", "theta_i", "phi_i")
        return xr.DataArray(np.sqrt(twice * total))

    def plot_lobes(self, *, kd: float | None = None) -> "Figure":
        """Draw its lobes in the plane of incidence, of the first Kd if none is given."""
        # Figures stand right of results: they are looked up when one is drawn.
        drawn = import_module("microsurf.report.figures.lobes_of_results")
        figure: Figure = drawn.figure({"result": self._dataset}, kd)
        return figure

    def _repr_html_(self) -> str:
        """Albedos with their standard errors, a row for each incidence and Kd."""
        rows = []
        for kd in self.scene.material.kd:
            mean = self.albedo(kd=kd).mean("realisation")
            error = self.standard_error(kd=kd)
            parts = self.albedo_by_order(kd=kd).mean("realisation").sel(order=1)
            for t, p in np.ndindex(mean.sizes["theta_i"], mean.sizes["phi_i"]):
                at: dict[str, Any] = {"theta_i": t, "phi_i": p}
                cells = (mean, error, *(parts.sel(kind=kind) for kind in detector.KINDS))
                angles = f"{mean.theta_i.values[t]:g}", f"{mean.phi_i.values[p]:g}"
                figures = (f"{float(cell.isel(at)):.4g}" for cell in cells)
                rows.append((*angles, f"{kd:g}", *figures))
        head = ("θ_i (°)", "φ_i (°)", "Kd", "albedo", "its standard error", "specular, order 1",
                "body, order 1")  # fmt: skip
        attrs = self._dataset.attrs
        return notebook.table(rows, head, f"{attrs.get('source', '')}: {attrs.get('model', '')}")


def _chosen(energy: xr.DataArray, order: int | None, kind: str | None) -> xr.DataArray:
    """Select what is named, and sum over what is not."""
    named = {name: value for name, value in (("order", order), ("kind", kind)) if value is not None}
    rest = [name for name in ("order", "kind") if name in energy.dims and name not in named]
    selected = energy.sel(named, drop=True) if named else energy
    return selected.sum(rest) if rest else selected
