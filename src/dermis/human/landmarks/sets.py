"""Names and descriptions of the published landmark sets that the parametric human has."""

LANDMARK_SETS = {
    "ibug-68": "the 68 of iBUG's 300-W",
    "face-synthetics-70": "those of ibug-68 and both pupils, as in FaceSynthetics",
    "mediapipe": "142 of MediaPipe's 478: outlines, the middle of the nose, both irises",
    "mediapipe-468": "all 468 points of MediaPipe's face mesh, most of them interpolated",
    "ibug-68-silhouette": "those of ibug-68, with the outline on the visible contour of the face",
}
"""Sets of landmarks of the parametric human, with descriptions."""
SILHOUETTE_SUFFIX = "-silhouette"
"""Suffix of the names of sets with several candidate points for some landmarks."""
