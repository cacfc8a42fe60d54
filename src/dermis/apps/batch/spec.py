"""Specification ("spec") of a data set: distributions of people, faces, lights and cameras, and a seed."""

from __future__ import annotations

import difflib
import hashlib
import re
from collections.abc import Iterator, Mapping
from functools import partial
from importlib import resources
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, Field, PrivateAttr

from dermis.apps.batch import spec_tables as tables
from dermis.apps.batch.blur.table import BlurTable
from dermis.apps.batch.clips.checks import check_clip
from dermis.apps.batch.clips.flow import FLOW_OUTPUTS
from dermis.apps.batch.clips.frames import ImageSequence
from dermis.apps.batch.clips.table import ClipTable
from dermis.apps.batch.distributions import Constant, Distribution
from dermis.apps.batch.output_encoding import Encoding
from dermis.apps.batch.rigs.table import RigTable
from dermis.apps.batch.rigs.views import Rig, check_rig, lens_values, load_rig, with_defaults
from dermis.apps.batch.sampling import Parameters, Sampler
from dermis.apps.batch.sensor.lens import Lens
from dermis.apps.batch.sensor.model import Sensor
from dermis.apps.batch.spec_checks import (
    check_backgrounds,
    check_blur,
    check_landmarks,
    check_lens,
    check_sensor,
    check_spec,
    note_lamps_without_blue,
)
from dermis.apps.batch.spec_files import check_hashes, expand_patterns, file_hashes
from dermis.base.errors import error_context, format_value, refuse, shorten
from dermis.base.quantities import checked_integer
from dermis.base.reading import checked_path, read_toml
from dermis.human.expressions import EXPRESSIONS, expand_targets
from dermis.human.landmarks.sets import LANDMARK_SETS
from dermis.scene.field_errors import BoundsReason, InvalidFieldsError
from dermis.scene.frozen_model import FrozenModel
from dermis.scene.outputs import check_outputs
from dermis.scene.settings import Settings
from dermis.scene.toml_text import key_text, table_text

MAX_IMAGES = 10**9
GENERATOR_VERSION = 6
"""Number of the rules that turn seeds into people and pictures; with other rules, a seed gives other people.

Number 1 stands for the people of version 0.1, number 2 for people with the skin of measured people, number 3
for people whose hair has also changed, and later numbers for further changes of people, hair and records.
"""
COUNT_LINE_PATTERN = re.compile(r"(?m)^count = (\d+)\n")
"""Line of a canonical spec with the number of images, which may be raised to let a data set grow."""
GENERATOR_LINE_PATTERN = re.compile(r"(?m)^generator = (\d+)\n")
"""Line of a canonical spec with the generator number; specs of number 1 have no such line."""
RENDER_DEFAULTS: Mapping[str, Any] = {"atlas": 1024, "exposure": "auto"}
"""Render settings of a spec without [render]."""
_BACKGROUND_TABLE = "[background]"
NON_RENDER_SETTINGS = {
    "size": "size, above all tables",
    "background": _BACKGROUND_TABLE,
    "background_blur": _BACKGROUND_TABLE,
}
"""Settings that are not keys of [render], and where a spec states them instead."""
_TargetWeight = Annotated[float, Field(ge=0, le=1)]
_TOML_HEADER = "# A data set of dermis: lengths in mm, colours linear Rec. 709."
_MAX_KEY_LENGTH, _MIN_KEY_SIMILARITY = 80, 0.7  # limits for suggestions to unknown keys
_FILE_PARAMETERS = "person.head", "environment.name", "skin.profile", "clip.motion", "background.picture"
"""Parameters whose values may be files."""
P = TypeVar("P", bound=FrozenModel)
_DeviceTable = dict[str, Annotated[Distribution, tables.DistributionField()]]


def _with_defaults(model: type[FrozenModel], table: _DeviceTable | None) -> _DeviceTable | None:
    """Return the table of a lens or sensor with the defaults of omitted keys, in the order of its model."""
    if table is None:
        return None
    defaults = model()
    complete = {name: table.get(name, Constant(getattr(defaults, name))) for name in model.model_fields}
    return complete | table  # unknown keys are refused later


class Spec(FrozenModel):
    """Specification of a data set, read from a TOML file."""

    count: Annotated[int, Field(ge=1, le=MAX_IMAGES), BoundsReason("a billion images")] = 1000
    """Number of images."""
    seed: Annotated[int, Field(ge=0, le=2**32 - 1), BoundsReason("32 bits")] = 0
    """Seed of all random numbers."""
    generator: Annotated[
        int,
        Field(ge=GENERATOR_VERSION, le=GENERATOR_VERSION),
        BoundsReason("this version makes other images from a spec"),
    ] = GENERATOR_VERSION
    """Number of the rules that turn seeds into pictures; a data set with another number is not continued."""
    images_per_person: Annotated[int, Field(ge=1, le=10**6), BoundsReason("a million of each")] = 1
    """Number of consecutive images that show the same person."""
    outputs: tuple[str, ...] = ()
    """Outputs written for each image beside the picture, as in `dermis render --outputs`."""
    landmarks: tuple[str, ...] = ("ibug-68",)
    """Landmark sets; for your own meshes, .csv files in the spec's folder with the columns name,vertex."""
    shard_size: Annotated[int, Field(ge=1, le=10**6), BoundsReason("a million in a file")] = 1000
    """Images per shard."""
    format: Literal["webdataset", "folder"] = "webdataset"
    """Shards as tar files (webdataset) or as folders."""
    encoding: Encoding = "png"
    """File format of the outputs: png (16 bits, where sufficient), exr or npy (all bits)."""
    keep_linear: Annotated[bool | None, AfterValidator(lambda keep: keep or None)] = None
    """Whether the linear picture before the model of the sensor is also stored; needs [sensor]."""
    render: Settings = Field(default_factory=lambda: Settings(size=(512, 512), **RENDER_DEFAULTS))
    """Render settings, without `size` and the background, which have their own keys."""
    person: tables.PersonTable = tables.PersonTable()
    """People."""
    expression: tables.ExpressionTable = tables.ExpressionTable()
    """Facial expression."""
    expressions: dict[str, dict[str, _TargetWeight]] = Field(default_factory=dict)
    """Expressions of this spec: weights of morph targets; a name without Left or Right sets both sides."""
    pose: dict[str, Annotated[Distribution, tables.DistributionField()]] = Field(default_factory=dict)
    """Weights of morph targets, replacing the expression's; a name without Left or Right sets both sides."""
    head: tables.HeadRotationTable = tables.HeadRotationTable()
    """Rotation of the head."""
    gaze: tables.GazeTable = tables.GazeTable()
    """Gaze direction."""
    camera: tables.CameraTable = tables.CameraTable()
    """Camera position."""
    skin: dict[str, Annotated[Distribution, tables.DistributionField()]] = Field(default_factory=dict)
    """Skin settings, as in scenes: roughness, oiliness, ..."""
    state: tables.StateTable | None = None
    """State of the skin: blush, pallor, cold, exertion, crying; without this table, skin is at rest."""
    light: tables.LightTable = tables.LightTable()
    """Lamps."""
    environment: tables.EnvironmentTable = tables.EnvironmentTable()
    """Environment light."""
    background: tables.BackgroundTable = tables.BackgroundTable()
    """Background."""
    clip: ClipTable | None = None
    """Frames of people in motion; without this table, images are single pictures."""
    rig: Annotated[RigTable | None, AfterValidator(with_defaults)] = None
    """Several cameras that see the same moment; without this table, there is one."""
    blur: BlurTable | None = None
    """Depth of field and motion blur of the pictures; without this table, pictures are sharp."""
    lens: Annotated[_DeviceTable | None, AfterValidator(partial(_with_defaults, Lens))] = None
    """Distortion of the camera's lens; needs [sensor]."""
    sensor: Annotated[_DeviceTable | None, AfterValidator(partial(_with_defaults, Sensor))] = None
    """Sensor and processing of the camera; without this table, pictures are as rendered."""
    correlated: tuple[tables.CorrelationGroup, ...] = ()
    """Correlated parameters."""
    files: dict[str, str] = Field(default_factory=dict)
    """SHA-256 of each file that the spec names; computed on reading, and compared if given."""
    folder: Path = Field(default=Path(), exclude=True)
    """Folder of the files that the spec names; not part of its TOML."""

    _sampler: Sampler = PrivateAttr()
    _digest: str = PrivateAttr("")
    _cameras: Rig | None = PrivateAttr(None)

    def model_post_init(self, context: object) -> None:
        """Check that the distributions of all tables are consistent, and create the sampler."""
        distributions = _table_distributions("", self)
        BaseModel.__setattr__(self, "_cameras", load_rig(self.rig, self.folder))
        expressions = {**EXPRESSIONS, **self.expressions}
        with error_context("outputs"):
            check_outputs(self.outputs)
        check_landmarks(self.landmarks, self.folder)
        check_spec(distributions, expressions, self.correlated, self.folder)
        if self.sensor is not None:
            check_sensor(distributions, self.render)
        for name in ("keep_linear", "lens"):
            if getattr(self, name) is not None and self.sensor is None:
                actual, advice = "there is none", "Add [sensor], which can be empty, or remove this key"
                refuse(name, "a table [sensor]", actual, advice)
        if self.lens is not None:
            check_lens(distributions, self.stored_outputs)
        if self.clip is not None:
            check_clip(self.clip, self.folder)
        if self.blur is not None:
            check_blur(distributions, self.render, has_clip=self.clip is not None)
        check_backgrounds(distributions, self.folder, has_rig=self.rig is not None)
        if self.cameras is not None:
            check_rig(self.cameras, distributions, self.size, has_lens=self.lens is not None)
        if self.images_per_person % self.sequence.images:
            expected = f"a multiple of {self.sequence.images}, the images of a clip with all its cameras"
            refuse("images_per_person", expected, f"got {self.images_per_person}", "Correct it, or remove it")
        rows = {name: row for group in self.correlated for name, row in group.cholesky_rows().items()}
        rig = self.cameras
        lenses = tuple(lens_values(rig, view) for view in range(len(rig.names))) if rig else ()
        sampler = Sampler(
            self.seed, self.images_per_person, distributions, rows, expressions, self.sequence, lenses
        )
        BaseModel.__setattr__(self, "_sampler", sampler)

    @property
    def size(self) -> tuple[int, int]:
        """Return width and height of the pictures [pixel]."""
        return self.render.size

    @property
    def sequence(self) -> ImageSequence:
        """Return the division of the images into clips and cameras."""
        frames, rate_hz = (self.clip.frames, self.clip.rate_hz) if self.clip else (1, 0.0)
        return ImageSequence(frames, rate_hz, len(self.cameras.names) if self.cameras else 1)

    @property
    def cameras(self) -> Rig | None:
        """Return the cameras of the rig; None for a spec with one camera."""
        return self._cameras

    @property
    def stored_outputs(self) -> tuple[str, ...]:
        """Return the names of all outputs that are written: `outputs`, and the flow of clips."""
        flow = FLOW_OUTPUTS if self.clip is not None and self.clip.flow else ()
        return (*self.outputs, *flow)

    @property
    def distributions(self) -> Mapping[str, Distribution]:
        """Return the distribution of each parameter by its dotted name, such as "light.key.size_mm"."""
        return self._sampler.distributions

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Return the names of all parameters that the images of this spec can have, in a fixed order."""
        return self._sampler.parameter_names

    @property
    def landmark_tables(self) -> Mapping[str, str]:
        """Return a dictionary from landmark set name to source: a preset name, or the path of a table."""
        return {name: name if name in LANDMARK_SETS else str(self.folder / name) for name in self.landmarks}

    @property
    def pose_targets(self) -> frozenset[str]:
        """Return the morph targets that the [pose] table sets; one key may set a left and a right target."""
        return frozenset(expand_targets(self.pose))

    def parameters(self, image_number: int) -> Parameters:
        """Return the sampled parameters of an image, by name; numbers are rounded to six significant digits.

        The parameters are the same on every machine and for any order of images. Changing or adding the
        distribution of one parameter does not change the samples of the others. Parameters that an image does
        not use, such as the parameters of unused lamps, are omitted.

        Raises DermisError if the data set has no image with this number.
        """
        return self._sampler.parameters(checked_integer("image", image_number, 0, self.count - 1))

    def neighbour_parameters(self, image_number: int, frame_offset: float) -> Parameters:
        """Return the parameters of another frame of an image's clip, which may be before or after the clip.

        frame_offset : number of frames after the image
        """
        return self._sampler.parameters(image_number, frame_offset)

    def to_toml(self) -> str:
        """Return the spec as canonical TOML with all values; `parse_spec` converts it to an equal spec."""
        values = fields_except_none(self)
        values = {"count": values.pop("count"), "seed": values.pop("seed"), "size": self.size} | values
        values["render"] = self.render.model_dump(exclude=set(NON_RENDER_SETTINGS), exclude_none=True)
        del values["folder"]
        return "\n".join([_TOML_HEADER, *_toml_lines("", values)])

    def digest(self) -> str:
        """Return the SHA-256 of the canonical TOML without `count`; this hash identifies the data set."""
        if not self._digest:
            text = COUNT_LINE_PATTERN.sub("", self.to_toml(), count=1)
            digest = hashlib.sha256(text.encode()).hexdigest()
            BaseModel.__setattr__(self, "_digest", digest)
        return self._digest


def _table_distributions(table_name: str, table_value: object) -> dict[str, Distribution]:
    """Return the distributions in a table of the spec and in the table's subtables, by dotted name.

    table_name : dotted name of the table; "" for the whole spec
    table_value : the table, or one of its values; values that are not distributions are ignored
    """
    if isinstance(table_value, Distribution):
        return {table_name: table_value}
    parts = fields_except_none(table_value) if isinstance(table_value, FrozenModel) else table_value
    if not isinstance(parts, Mapping):
        return {}
    found: dict[str, Distribution] = {}
    for key, part in parts.items():
        found |= _table_distributions(f"{table_name}.{key}" if table_name else key, part)
    return found


def load_spec(path: str | Path, **values: object) -> Spec:
    """Return the spec in a TOML file; paths in the file are relative to the folder of the file.

    values : `count`, `seed`, `size` or `format`, replacing the values in the file

    Raises DermisError for missing files, and for values that cannot be rendered; the message states their
    table and key.
    """
    path = checked_path(path, "a spec of a data set in TOML")
    data = read_toml(path, "a spec of a data set in TOML")
    with error_context(path):
        return parse_spec({**data, **values}, path.parent)


def parse_spec(toml_data: Mapping[str, object], folder: Path = Path()) -> Spec:
    """Return the spec for parsed TOML.

    folder : folder to which file names in the spec are relative

    Raises DermisError as `load_spec` does.
    """
    if "folder" in toml_data:
        refuse("folder", "no such key", "it is given", "Paths are relative to the folder of the spec")
    if toml_data.get("generator", GENERATOR_VERSION) != GENERATOR_VERSION:
        actual = f"got {format_value(toml_data['generator'])}"
        advice = "Remove it to start another data set, or use the version of dermis that wrote it"
        refuse("generator", f"{GENERATOR_VERSION}, the generator number of this version", actual, advice)
    _refuse_unknown_keys(toml_data)
    fields = {k: v if k == "files" else expand_patterns(v, folder, k) for k, v in toml_data.items()}
    fields["render"] = _parse_render_table(fields.pop("size", (512, 512)), fields.get("render", {}))
    if isinstance(groups := fields.get("correlated", ()), list | tuple):
        fields["correlated"] = tuple(_build_model(tables.CorrelationGroup, "correlated", g) for g in groups)
    spec = _build_model(Spec, "", _with_images_per_person(fields, folder) | {"folder": folder})
    if spec.sensor is not None:
        note_lamps_without_blue(spec.distributions)
    names = [name for name in spec.landmarks if name not in LANDMARK_SETS]
    names += [spec.rig.file] if spec.rig is not None and spec.rig.file else []
    for parameter in spec.distributions.keys() & set(_FILE_PARAMETERS):
        names += map(str, spec.distributions[parameter].support)
    hashes = file_hashes(names, folder)
    if spec.files:
        check_hashes(spec.files, hashes)
    return spec.replace(files=hashes) if hashes else spec


def example_toml() -> str:
    """Return a commented example spec that can be rendered unchanged."""
    return resources.files(__package__).joinpath("example.toml").read_text("utf-8")


def _refuse_unknown_keys(toml_data: Mapping[str, object]) -> None:
    """Raise DermisError for an unknown key above all tables; the message names tables that have the key."""
    known = [name for name in ("size", *Spec.model_fields) if name != "folder"]
    for key in toml_data:
        if key in known:
            continue
        similar = difflib.get_close_matches(key[:_MAX_KEY_LENGTH], known, 1, _MIN_KEY_SIMILARITY)
        owners = sorted(_tables_with_key(Spec, key))
        if owners:
            expected = f"this key in {' or '.join(f'[{name}]' for name in owners)}"
            actual, advice = "it is above all tables", "Move it into a table"
        else:
            expected = similar[0] if similar else f"one of {', '.join(known)}"
            actual, advice = "this name is unknown", "Correct the name"
        refuse(f"spec: {shorten(key, _MAX_KEY_LENGTH)}", expected, actual, advice)


def _tables_with_key(model: type[BaseModel], key: str, table_name: str = "") -> Iterator[str]:
    """Yield the dotted names of the tables of a spec that have a key."""
    for name, info in model.model_fields.items():
        kind, path = _table_class(info.annotation), f"{table_name}.{name}" if table_name else name
        if kind is not None:
            if key in kind.model_fields:
                yield path
            yield from _tables_with_key(kind, key, path)


def _with_images_per_person(fields: dict[str, object], folder: Path) -> dict[str, object]:
    """Return the parsed fields of a spec, in which each person has one clip or moment by default."""
    if "images_per_person" in fields or not {"clip", "rig"} & fields.keys():
        return fields
    built: dict[str, object] = {}
    frames, views = 1, 1
    if "clip" in fields:
        built["clip"] = clip = _build_model(ClipTable, "clip", fields["clip"])
        frames = clip.frames
    if "rig" in fields:
        built["rig"] = table = with_defaults(_build_model(RigTable, "rig", fields["rig"]))
        rig = load_rig(table, folder)
        views = len(rig.names) if rig else 1
    return {**fields, **built, "images_per_person": frames * views}


def _parse_render_table(picture_size: object, render_table: object) -> Settings:
    if not isinstance(render_table, Mapping):
        return _build_model(Settings, "render", render_table)
    for key in NON_RENDER_SETTINGS.keys() & render_table.keys():
        advice = f"Write it as {NON_RENDER_SETTINGS[key]}"
        refuse(f"render: {key}", "no such key in [render]", "it is given here", advice)
    return _build_model(Settings, "render", {**RENDER_DEFAULTS, **render_table, "size": picture_size})


def _table_class(annotation: object) -> type[FrozenModel] | None:
    """Return the class of the table that a field holds, which may be optional; None for other fields."""
    kinds = get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)
    return next((one for one in kinds if isinstance(one, type) and issubclass(one, FrozenModel)), None)


def _build_model(model_class: type[P], table_name: str, toml_table: object) -> P:
    """Convert a table of a spec, with its subtables, to an instance of a pydantic class.

    model_class : pydantic class of the table
    table_name : name of the table in error messages
    toml_table : parsed TOML of the table, or an instance of the class, which is returned unchanged
    """
    if isinstance(toml_table, model_class):
        return toml_table
    if not isinstance(toml_table, Mapping):
        expected = f"a table with {', '.join(model_class.model_fields)}"
        refuse(table_name, expected, f"got {format_value(toml_table)}", "Correct it")
    values = dict(toml_table)
    for name, info in model_class.model_fields.items():
        kind = _table_class(info.annotation)
        if kind is not None and values.get(name) is not None:
            values[name] = _build_model(kind, f"{table_name}.{name}" if table_name else name, values[name])
    try:
        return model_class(**values)
    except InvalidFieldsError as error:
        if set(error.messages) <= {"size", "size.0", "size.1"}:  # above all tables, not in [render]
            table_name = "spec"
        raise InvalidFieldsError(table_name or "spec", error.messages) from None


def fields_except_none(spec_table: FrozenModel) -> dict[str, object]:
    """Return the fields of a table of the spec that are not None, by name."""
    values = {name: getattr(spec_table, name) for name in type(spec_table).model_fields}
    return {name: value for name, value in values.items() if value is not None}


def _toml_lines(table_name: str, table_values: Mapping[str, object]) -> list[str]:
    """Return a table and its subtables as lines of TOML.

    table_name : dotted name of the table
    """
    own_values, sub_lines = dict[str, object](), list[str]()
    for name, value in table_values.items():
        path = f"{table_name}.{key_text(name)}" if table_name else key_text(name)
        if isinstance(value, FrozenModel | Mapping):
            sub_lines += _toml_lines(
                path, fields_except_none(value) if isinstance(value, FrozenModel) else value
            )
        elif isinstance(value, tuple) and value and isinstance(value[0], FrozenModel):
            sub_lines += [table_text(f"[[{path}]]", fields_except_none(one)) for one in value]
        else:
            own_values[name] = value.spec_value() if isinstance(value, Distribution) else value
    if sub_lines and not own_values:
        return sub_lines
    return [table_text(f"[{table_name}]" if table_name else "", own_values), *sub_lines]
