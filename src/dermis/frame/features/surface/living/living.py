"""Maps of skin whose colour and gloss change with states such as a blush and with the pulse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.surface import mips as map_mips
from dermis.frame.programs import HALF_TEXEL_FORMAT, program
from dermis.gpu import (
    CommandList,
    ComputeProgram,
    Constants,
    Device,
    Graph,
    MutableBindings,
    Recorder,
    Texture,
    UniformRecord,
    make_texture,
    upload,
)
from dermis.human.living.zones import (
    LARGEST_OXYGEN_DROP,
    ZoneChanges,
    longest_delay_s,
    pulse_changes,
    state_changes,
)
from dermis.human.skin.colours import skin_colour_table
from dermis.human.skin.look import SkinLook
from dermis.optics.bands import Bands
from dermis.scene.living import PULSE_SAMPLE_COUNT, SkinState

LIVING_CONSTANTS: Constants = (("LIVING", 1),)
"""Pipeline constants of expression.wgsl for skin with a state or a pulse."""
_LEAST_OXYGEN = 0.02
_LEAST_COLOUR = 1e-6  # replaces colours that are black, which have no logarithm


@dataclass(frozen=True, eq=False)
class LivingMaps:
    """Specular and roughness maps of skin in a state, and the inputs of the passes that fill them.

    zone_bindings : dictionary from names in zone_sums.wgsl to resources
    gloss_bindings : dictionary from names in living_gloss.wgsl to resources
    bindings : dictionary from names in expression.wgsl to resources
    specular, roughness : textures with all mip levels
    oxygen_per_layer : decrease of the oxygen saturation from the first to the second table [-]
    """

    zone_bindings: MutableBindings
    gloss_bindings: MutableBindings
    bindings: MutableBindings
    specular: map_mips.MippedTexture
    roughness: map_mips.MippedTexture
    oxygen_per_layer: float


def make_living_maps(
    device: Device,
    look: SkinLook,
    zone_bindings: MutableBindings,
    specular: Texture,
    roughness: Texture,
    bands: Bands | None = None,
) -> LivingMaps:
    """Allocate the maps of skin in a state, and compute the map of amplitudes and delays of the pulse.

    zone_bindings : painted surface and its tables, by their names in the shaders that paint skin
    specular, roughness : painted maps at rest
    bands : wavelengths in the place of red, green and blue
    """
    side = specular.size[0]
    states, pulse = (make_texture(device, (side, side), HALF_TEXEL_FORMAT) for _ in range(2))
    frame = CommandList(device, timed=False)
    zones, map_shape = zone_bindings, (side, side)
    _draw_zone_sums(frame, zones | {"change_map": pulse}, map_shape, pulse_changes(), has_blotches=False)
    frame.submit()
    tables, oxygen_per_layer = blood_tables(look, bands)
    changed = map_mips.empty_map(device, map_shape), map_mips.empty_map(device, map_shape)
    gloss: MutableBindings = {
        "specular_at_rest": specular,
        "roughness_at_rest": roughness,
        "state_map": states,
    }
    gloss |= {"specular": changed[0].levels[0], "roughness": changed[1].levels[0]}
    bindings: MutableBindings = {"roughness_at_rest": roughness, "state_map": states, "pulse_map": pulse}
    bindings["blood_tables"] = _upload_tables(device, tables)
    return LivingMaps(zones | {"change_map": states}, gloss, bindings, *changed, oxygen_per_layer)


def blood_tables(look: SkinLook, bands: Bands | None = None) -> tuple[NDArray[np.float32], float]:
    """Return tables (3, n, n, 3) of the colour, and the difference of oxygen between the first two [-].

    The first table is the natural logarithm of the colour at the oxygen saturation of `look`, the second at a
    lower saturation, and the third the derivative of the first with respect to the logarithm of the blood
    fraction. The axes are the square roots of the fractions of melanin and of blood, as in `ColourTable`.
    """
    low = max(look.oxygen - LARGEST_OXYGEN_DROP, min(_LEAST_OXYGEN, 0.5 * look.oxygen))
    first, second = (_log_colours(look, oxygen, bands) for oxygen in (look.oxygen, low))
    root = np.linspace(0.0, 1.0, first.shape[1])
    derivative = np.gradient(first, root, axis=1) * (0.5 * root)[None, :, None]
    return np.stack([first, second, derivative]).astype(np.float32), max(look.oxygen - low, 1e-3)


def _log_colours(look: SkinLook, oxygen: float, bands: Bands | None) -> NDArray[np.float64]:
    colours = skin_colour_table(look.eumelanin, oxygen, look.epidermis_mm, bands).colours
    return np.log(np.maximum(colours, _LEAST_COLOUR))


def _upload_tables(device: Device, tables: NDArray[np.float32]) -> Texture:
    count, nodes = tables.shape[:2]
    texture = make_texture(device, (nodes, nodes), "rgba32float", layer_count=count, content_source="map")
    for layer, table in enumerate(tables):
        upload(device, texture, np.pad(table, ((0, 0), (0, 0), (0, 1))), layer=layer)
    return texture


def draw_state(graph: Graph, living: LivingMaps, skin_state: SkinState) -> None:
    """Declare the passes that compute the specular and roughness maps and the blood of skin in a state."""
    draw_state_texels(graph, living, skin_state)
    for one in (living.specular, living.roughness):
        graph.add_replayable(map_mips.fill_mips, one)


def draw_state_texels(recorder: Recorder, living: LivingMaps, skin_state: SkinState) -> None:
    """Declare the passes of `draw_state` that fill only the finest mip levels."""
    map_shape, changes = living.specular.size, state_changes(skin_state.weights)
    _draw_zone_sums(recorder, living.zone_bindings, map_shape, changes, has_blotches=True)
    shader = program(recorder.device, "surface/living/living_gloss.wgsl")
    record = shader.make_record("Gloss", side=map_shape[0])
    recorder.compute("maps", shader, living.gloss_bindings | {"gloss": record}, map_shape)


def _draw_zone_sums(
    recorder: Recorder,
    bindings: MutableBindings,
    map_shape: tuple[int, int],
    changes: ZoneChanges,
    *,
    has_blotches: bool,
) -> None:
    shader = program(recorder.device, "surface/living/zone_sums.wgsl")
    everywhere, lips, lid_edges = changes.masks
    record = shader.make_record(
        "ZoneChanges",
        everywhere=everywhere,
        lips=lips,
        lid_edges=lid_edges,
        blotches=float(has_blotches),
        zones=changes.zones,
    )
    recorder.compute("maps", shader, bindings | {"changes": record}, map_shape)


def pulse_record(shader: ComputeProgram, living: LivingMaps, skin_state: SkinState) -> UniformRecord:
    """Return the uniform record of the struct `Living` of expression.wgsl."""
    blood = np.zeros(PULSE_SAMPLE_COUNT) if skin_state.blood is None else skin_state.blood
    return shader.make_record(
        "Living",
        oxygen_per_layer=living.oxygen_per_layer,
        longest_delay_s=longest_delay_s(),
        pulse=blood.reshape(-1, 4),
    )
