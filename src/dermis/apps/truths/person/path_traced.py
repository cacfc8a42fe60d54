"""Reference images of a person by path tracing, with the variance of each pixel."""

from __future__ import annotations

import hashlib

import numpy as np

from dermis.apps.truths.mitsuba_scene import (
    RUSSIAN_ROULETTE_DEPTH,
    coverage_scene,
    load_mitsuba,
    mesh_shape,
    mitsuba_scene,
)
from dermis.apps.truths.path_traced import (
    MitsubaVariant,
    PathTraced,
    ProgressCallback,
    hash_lighting,
    hash_medium,
    pass_count,
    render_passes,
    samples_per_pass,
)
from dermis.apps.truths.person.medium import ALBEDO_GRID_SIDE_VOXELS, COAT_TRANSMITTANCE, skin_media
from dermis.apps.truths.person.person import Person, SkinTextures, posed_person
from dermis.apps.truths.person.shapes import (
    diffuse_skin_shapes,
    eye_shapes,
    hair_shapes,
    mitsuba_texture,
    skin_shapes,
)
from dermis.apps.truths.scene_description import Mitsuba, MitsubaObject, SceneDict, mitsuba_rgb
from dermis.mesh.mesh import Material
from dermis.optics.media import Medium
from dermis.scene.model import Scene

_CACHE_VERSION = "person 2"  # change when the result for the same person changes
_SALIVA_ROUGHNESS, _TONGUE_ROUGHNESS = 0.12, 0.25
_SALIVA_IOR = 1.4


def path_trace_person(
    scene: Scene,
    textures: SkinTextures,
    medium: Medium | None,
    size: tuple[int, int],
    samples: int = 64,
    *,
    max_depth: int | None = None,
    variant: MitsubaVariant = "scalar_rgb",
    use_cache: bool = True,
    progress: ProgressCallback | None = None,
) -> PathTraced:
    """Return the path-traced image of the person in a scene, with the given textures.

    The skin consists of layers below a surface with the two specular lobes of the real-time renderer. This
    surface refracts light if the medium has the index of refraction `SKIN_ETA`, and does not if the index is
    1. A grid of albedos in the deepest layer gives the skin the colours of its colour map. Lights must have a
    size, because the cornea refracts the light on its way to the iris. The skin settings of the scene are
    ignored.

    textures : textures of skin, eyes and teeth
    medium : layers of a skin that has the mean colour of the colour map, see `uniform_skin` and
        `pigmented_skin`; None for Lambertian skin with the colours of the colour map
    size : width and height of the image [pixel]
    max_depth : largest number of scattering events plus 1, so 2 for direct light; None for no limit
    samples, variant, use_cache, progress : as in `path_trace`

    Raises DermisError when Mitsuba is missing, and for heads without modelled eyes.

    Sources: [Jakob2022], [Miller2019], [Chiang2016].
    """
    target_count, mi = pass_count(samples, variant), load_mitsuba()
    person = posed_person(scene, textures)
    voxels = ALBEDO_GRID_SIDE_VOXELS
    constants = (
        f"{samples_per_pass(variant)} {RUSSIAN_ROULETTE_DEPTH} {COAT_TRANSMITTANCE} {voxels} {max_depth}"
    )
    trace_settings = f"{_CACHE_VERSION} {mi.__version__} {variant} {constants} {size}"
    key = person_cache_key(scene, person, medium, trace_settings) if use_cache else None
    return render_passes(
        mi,
        variant,
        target_count,
        size,
        key,
        lambda: person_scene(mi, scene, person, medium, size, max_depth),
        lambda: coverage_scene(mi, scene.camera, size, _emissive_head(mi, person)),
        progress,
    )


def person_scene(
    mi: Mitsuba,
    scene: Scene,
    person: Person,
    medium: Medium | None,
    picture_size: tuple[int, int],
    max_depth: int | None = None,
) -> tuple[MitsubaObject, tuple[str, ...]]:
    """Return the Mitsuba scene that renders a person's radiance, and notes on changes made to the head.

    medium, max_depth : as in `path_trace_person`
    """
    notes: tuple[str, ...] = ()
    if medium is None:
        shapes = diffuse_skin_shapes(mi, person)
    else:
        media = skin_media(mi, person, scene.camera, medium)
        shapes, notes = skin_shapes(mi, person, medium, media)
    shapes |= eye_shapes(mi, person) | _opaque_shapes(mi, person)
    for number, hairs in enumerate(person.hairs):
        shapes |= hair_shapes(mi, hairs, f"hairs_{number}")
    integrator = {"type": "volpathmis", "rr_depth": RUSSIAN_ROULETTE_DEPTH, "hide_emitters": True}
    if max_depth is not None:
        integrator["max_depth"] = max_depth
    return mitsuba_scene(mi, scene, integrator, shapes, picture_size), notes


def _opaque_shapes(mi: Mitsuba, person: Person) -> SceneDict:
    """Return the Mitsuba shapes of all materials other than skin and eyes.

    Teeth and tongue are coated with saliva; all other materials are diffuse.
    """
    shapes = {}
    mesh = person.mesh
    for k, material in enumerate(mesh.materials):
        triangles = mesh.triangles[mesh.material == k]
        if material.kind == "skin" or k in person.eye_materials or not len(triangles):
            continue
        used, corners = np.unique(triangles, return_inverse=True)
        bsdf = mi.load_dict(_opaque_bsdf(mi, person, material))
        positions, normals, uv = mesh.positions[used], mesh.normals[used], mesh.uv[used]
        shapes[f"part_{k}"] = mesh_shape(mi, positions, corners.reshape(-1, 3), normals, uv, bsdf=bsdf)
    return shapes


def _opaque_bsdf(mi: Mitsuba, person: Person, material: Material) -> SceneDict:
    if material.part is None:
        return {"type": "diffuse", "reflectance": mitsuba_rgb(material.colour)}
    tongue = material.part == "tongue"
    upper, lower = person.textures.teeth
    texture = upper if material.part == "upper teeth" else lower
    colour = mitsuba_rgb(material.colour) if tongue else mitsuba_texture(mi, texture)
    return {
        "type": "roughplastic",
        "distribution": "beckmann",
        "alpha": _TONGUE_ROUGHNESS if tongue else _SALIVA_ROUGHNESS,
        "int_ior": _SALIVA_IOR,
        "diffuse_reflectance": colour,
    }


def _emissive_head(mi: Mitsuba, person: Person) -> SceneDict:
    """Return the head without hair as a shape that emits radiance 1, to render its coverage of the pixels."""
    emitter, mesh = mi.load_dict({"type": "area", "radiance": 1.0}), person.mesh
    return {"head": mesh_shape(mi, mesh.positions, mesh.triangles, mesh.normals, emitter=emitter)}


def person_cache_key(scene: Scene, person: Person, medium: Medium | None, trace_settings: str) -> str:
    """Return a hash of all inputs of a path-traced person, used as the name of the cached passes.

    medium : as in `path_trace_person`
    trace_settings : versions and settings of the path tracer
    """
    digest = hashlib.sha256(f"{trace_settings} {person.textures.reach_mm} {person.eye_materials}".encode())
    hash_lighting(digest, scene)
    digest.update(repr(person.mesh.materials).encode())
    if medium is not None:
        hash_medium(digest, medium)
    for array in person.arrays():
        digest.update(f"{array.shape} {array.dtype}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:40]
