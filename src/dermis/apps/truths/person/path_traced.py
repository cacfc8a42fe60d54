"""Reference images of a person by path tracing, with the variance of each pixel."""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.mitsuba_scene import (
    ROULETTE_DEPTH,
    coverage_scene,
    load_mitsuba,
    mesh_shape,
    mitsuba_scene,
)
from dermis.apps.truths.path_traced import (
    SAMPLES_PER_PASS,
    MitsubaVariant,
    PathTraced,
    ProgressCallback,
    hash_lighting,
    pass_count,
    render_passes,
)
from dermis.apps.truths.person.medium import COAT_TRANSMITTANCE, GRID_VOXELS, mean_free_paths, skin_medium
from dermis.apps.truths.person.person import Person, SkinTextures, posed_person
from dermis.apps.truths.person.shapes import eye_shapes, hair_shapes, mitsuba_texture, skin_shapes
from dermis.apps.truths.scene_description import Mitsuba, MitsubaObject, SceneDict, mitsuba_rgb
from dermis.mesh.mesh import Material
from dermis.scene.model import Scene

Doubles = NDArray[np.float64]
_CACHE_VERSION = "person 1"  # change when the result for the same person changes
_SALIVA_ROUGHNESS, _TONGUE_ROUGHNESS = 0.12, 0.25
_SALIVA_INDEX = 1.4


def path_trace_person(
    scene: Scene,
    textures: SkinTextures,
    distance_mm: Doubles,
    colour: Doubles,
    size: tuple[int, int],
    samples: int = 64,
    *,
    variant: MitsubaVariant = "scalar_rgb",
    use_cache: bool = True,
    progress: ProgressCallback | None = None,
) -> PathTraced:
    """Return the path-traced image of the person in a scene, with the given textures.

    The skin is a medium under a rough coat that does not refract; its albedo is a grid of painted colours.
    The cornea refracts, and the iris is a painted disc behind it, so lights must have a size. The skin's
    profile and surface lobe are ignored.

    textures : textures of skin, eyes and teeth
    distance_mm : (3,) mean lateral offset of exit points in skin of the mean colour [mm]
    colour : (3,) mean colour of the skin, linear Rec. 709 [-]
    size : width and height of the image [pixel]
    samples, variant, use_cache, progress : as in `path_trace`

    Raises DermisError when Mitsuba is missing, and for heads without modelled eyes.

    Sources: [Jakob2022], [Miller2019], [Chiang2016].
    """
    target_count, mi = pass_count(samples), load_mitsuba()
    person, path = posed_person(scene, textures), mean_free_paths(colour, distance_mm)
    constants = f"{SAMPLES_PER_PASS} {ROULETTE_DEPTH} {COAT_TRANSMITTANCE} {GRID_VOXELS}"
    trace_settings = f"{_CACHE_VERSION} {mi.__version__} {variant} {constants} {size}"
    key = person_key(scene, person, path, trace_settings) if use_cache else None
    return render_passes(
        mi,
        variant,
        target_count,
        size,
        key,
        lambda: person_scene(mi, scene, person, path, size),
        lambda: coverage_scene(mi, scene.camera, size, _emissive_head(mi, person)),
        progress,
    )


def person_scene(
    mi: Mitsuba, scene: Scene, person: Person, mean_free_path_mm: Doubles, size: tuple[int, int]
) -> tuple[MitsubaObject, tuple[str, ...]]:
    """Return the Mitsuba scene of a person's radiance image, and notes on changes made to the head.

    mean_free_path_mm : (3,) mean free paths in the skin [mm]
    """
    medium = skin_medium(mi, person, scene.camera, mean_free_path_mm)
    shapes, notes = skin_shapes(mi, person, medium)
    shapes |= eye_shapes(mi, person) | _opaque_parts(mi, person)
    for number, hairs in enumerate(person.hairs):
        shapes |= hair_shapes(mi, hairs, f"hairs_{number}")
    integrator = {"type": "volpathmis", "rr_depth": ROULETTE_DEPTH, "hide_emitters": True}
    return mitsuba_scene(mi, scene, integrator, shapes, size), notes


def _opaque_parts(mi: Mitsuba, person: Person) -> SceneDict:
    """Return the Mitsuba shapes of materials other than skin and eyes.

    Teeth and tongue are under saliva, all others diffuse.
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
        "int_ior": _SALIVA_INDEX,
        "diffuse_reflectance": colour,
    }


def _emissive_head(mi: Mitsuba, person: Person) -> SceneDict:
    """Return the shape of the head without hair, which emits radiance 1, for the image of the coverage."""
    emitter, mesh = mi.load_dict({"type": "area", "radiance": 1.0}), person.mesh
    return {"head": mesh_shape(mi, mesh.positions, mesh.triangles, mesh.normals, emitter=emitter)}


def person_key(scene: Scene, person: Person, mean_free_path_mm: Doubles, trace_settings: str) -> str:
    """Return a hash of all inputs of a path-traced person, used as the name of the cached passes.

    trace_settings : versions and settings of the path tracer
    """
    digest = hashlib.sha256(f"{trace_settings} {person.textures.reach_mm} {person.eye_materials}".encode())
    hash_lighting(digest, scene)
    digest.update(repr(person.mesh.materials).encode())
    for array in (*person.arrays(), mean_free_path_mm):
        digest.update(f"{array.shape} {array.dtype}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:40]
