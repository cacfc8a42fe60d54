"""Light from skin to skin: links between patches, and the passes that light them and let light bounce."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import cycle, islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.interreflection import SAMPLES, SIDE, Links, cached_links
from dermis.frame.programs import EACH, each, program
from dermis.gpu import Bindings, Buffer, Constants, Device, Memo, Recorder, scratch
from dermis.mesh.head import Head

LinkBuffers = tuple[tuple[Buffer, int], dict[str, Buffer], dict[str, Buffer]]
"""Places and their number, links of patches, links of cells."""
_TEXEL = 16  # bytes of four floats
_BOUNCES = 4  # between patches; gathering adds another
_TEAM = 16  # invocations of a patch or a cell


def link_numbers() -> dict[str, int]:
    """What shaders fill in."""
    return {"linked_side": SIDE, "linked_samples": SAMPLES}


@dataclass(frozen=True, eq=False)
class LinkSpace:
    """What light from skin to skin needs that is alike for all skins.

    places : buffer of the places at which patches are lit, and how many there are
    bounces, cells : buffers of the links of patches and of cells, by their names in the shaders
    occluded : whether cells hold the mean of what they see, as the map of occlusion says how much that is
    emitted : buffer of the light that leaves places
    leaving : buffer of the light that leaves patches without bounces
    around : buffer of that which leaves them where 1 arrives from everywhere
    patches : two buffers of the light that leaves patches after bounces, in turn
    from_skin, unlit : buffers of the light that reaches cells, and of none
    """

    places: tuple[Buffer, int]
    bounces: dict[str, Buffer]
    cells: dict[str, Buffer]
    occluded: bool
    emitted: Buffer
    leaving: Buffer
    around: Buffer
    patches: tuple[Buffer, Buffer]
    from_skin: Buffer
    unlit: Buffer

    @property
    def nbytes(self) -> int:
        """Of all but the space between passes, each once."""
        read = (self.places[0], *self.bounces.values(), *self.cells.values(), self.from_skin)
        return sum(int(one.size) for one in read)


class Interreflection(NamedTuple):
    """Light from skin to skin, and the (3,) albedo of the profile."""

    space: LinkSpace
    albedo: NDArray[np.float64]


def interreflection_of(
    memo: Memo,
    device: Device,
    head: Head,
    atlas: Atlas,
    albedo: NDArray[np.float64],
    occluded: bool,
    light: str,
    of: str,
) -> Interreflection | None:
    """Light from skin to skin, None for a head that sees nothing of itself.

    albedo : (3,) of the profile
    occluded : whether it is known how much of the sky each place sees
    light : whose it is, of several views in turn
    of : name of the atlas among several
    """
    links = memo.keep(_found, head, atlas, of=of)
    if not len(links.share):
        return None
    buffers = memo.keep(_uploaded, device, links, of=of)
    return Interreflection(memo.keep(_space, device, buffers, occluded, light, of=f"{of} {light}"), albedo)


def no_interreflection(device: Device) -> Buffer:
    """A buffer of no light."""
    return device.shared("no interreflection", lambda: device.space(_TEXEL * SIDE * SIDE))


def _found(head: Head, atlas: Atlas) -> Links:
    return cached_links(head.mesh, atlas.place, atlas.mapped)


def _uploaded(device: Device, links: Links) -> LinkBuffers:
    """Places, and links of patches and cells."""
    places = np.stack([links.triangle, links.weights], axis=1)
    bounces = _rows(device, links.bounce_first, links.bounce_patch, links.bounce_share)
    cells = _rows(device, links.first, links.patch, links.share)
    own = np.stack([links.own, links.held.view(np.uint32)], axis=1)
    cells["cells"] = device.buffer(own, "STORAGE")
    return (device.buffer(places, "STORAGE"), len(places)), bounces, cells


def _rows(
    device: Device, first: NDArray[np.uint32], patch: NDArray[np.uint32], share: NDArray[np.float32]
) -> dict[str, Buffer]:
    links = np.stack([patch, share.view(np.uint32)], axis=1)
    links = links if len(links) else np.zeros((1, 2), np.uint32)
    return {"first": device.buffer(first, "STORAGE"), "links": device.buffer(links, "STORAGE")}


def _space(
    device: Device,
    buffers: LinkBuffers,
    occluded: bool,
    _: str,
) -> LinkSpace:
    places, bounces, cells = buffers
    leaving, around, *patches = (
        mark_scratch(device, device.space(_TEXEL * (places[1] // SAMPLES))) for _ in range(4)
    )
    return LinkSpace(
        places=places,
        bounces=bounces,
        cells=cells,
        occluded=occluded,
        emitted=mark_scratch(device, device.space(2 * _TEXEL * places[1])),
        leaving=leaving,
        around=around,
        patches=(patches[0], patches[1]),
        from_skin=device.space(_TEXEL * SIDE * SIDE),
        unlit=no_interreflection(device),
    )


def draw(graph: Recorder, lit: Bindings, made: Interreflection, constants: Constants) -> None:
    """Find the light that skin sends to skin.

    lit : what patches are lit with
    constants : pipeline constants of the lights

    Source: [Goral1984].
    """
    shader, (space, albedo) = (
        program(graph.device, "interreflection/interreflection_points.wgsl", constants),
        made,
    )
    (places, count), footprint = space.places, 2.0 / (SIDE * SAMPLES**0.5)
    record = shader.record("Leaving", places=count, footprint=footprint, albedo=albedo)
    own: Bindings = {"leaving": record, "places": places, "emitted": space.emitted, "from_skin": space.unlit}
    graph.dispatch("interreflection", shader, {**lit, **own}, each(count))
    graph.repeat(_carry, space)


def _carry(graph: Recorder, made: LinkSpace) -> None:
    """Let light bounce between the patches, and gather it."""
    device, sent, team = graph.device, made.leaving, _team(graph.device)
    chosen: Constants = (("TEAM", team), ("MEAN", int(made.occluded)))
    patches, cells = each(made.places[1] // SAMPLES, EACH // team), each(SIDE * SIDE, EACH // team)
    alike = {"leaving": made.leaving, "around": made.around}
    means = program(device, "interreflection/interreflection_means.wgsl", chosen[:1])
    graph.dispatch("interreflection", means, {"emitted": made.emitted, **alike}, patches)
    bounce = program(device, "interreflection/interreflection_bounce.wgsl", chosen)
    for after in islice(cycle(made.patches), _BOUNCES):
        bound: Bindings = {**made.bounces, **alike, "sent": sent, "after": after}
        graph.dispatch("interreflection", bounce, bound, patches)
        sent = after
    gather = program(device, "interreflection/interreflection_gather.wgsl", chosen)
    gathered: Bindings = {**made.cells, "sent": sent, "from_skin": made.from_skin}
    graph.dispatch("interreflection", gather, gathered, cells)


def _team(device: Device) -> int:
    """Invocations that share links: few patches leave a GPU idle, and software waits at barriers."""
    return 1 if device.adapter.kind == "CPU" else _TEAM
