"""Data sets in Python: specs, arrays, a stream, photographs, and exports of keypoints and movies."""

from dermis.apps.batch.image_facts import SPLIT_NAMES
from dermis.apps.batch.keypoint_files import export_keypoints
from dermis.apps.batch.movie_files import export_movies
from dermis.apps.batch.reader import decode_image, read_dataset
from dermis.apps.batch.sensor.lens import Lens
from dermis.apps.batch.sensor.model import Sensor
from dermis.apps.batch.sensor.photograph import Photograph, photograph
from dermis.apps.batch.spec import Spec, load_spec, parse_spec
from dermis.apps.batch.stream import stream
from dermis.apps.batch.training_arrays import arrays, parameter_names

__all__ = [
    "SPLIT_NAMES",
    "Lens",
    "Photograph",
    "Sensor",
    "Spec",
    "arrays",
    "decode_image",
    "export_keypoints",
    "export_movies",
    "load_spec",
    "parameter_names",
    "parse_spec",
    "photograph",
    "read_dataset",
    "stream",
]
