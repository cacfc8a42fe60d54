"""Command that writes docs/accuracy.md from docs/templates/accuracy.md."""

from __future__ import annotations

from dermis.apps.validation.accuracy import blur, cycles_comparison, light, optics, slabs, specular, thin
from dermis.apps.validation.pages import DOCS, fill_page
from dermis.gpu import open_device

PAGE = DOCS / "accuracy.md"


def write_accuracy_page(adapter: str = "auto") -> None:
    """Measure the errors of the approximations that frames use, and write docs/accuracy.md."""
    device = open_device(adapter)
    fill_page(
        PAGE,
        adapter=f"{device.adapter.name}, {device.adapter.backend}",
        **blur.blur_error_texts(device),
        **cycles_comparison.cycles_comparison_texts(),
        **specular.specular_error_tables(),
        **light.light_error_tables(adapter),
        **optics.optics_error_tables(),
        **slabs.slab_error_tables(adapter),
        **thin.thin_body_error_tables(adapter),
    )
