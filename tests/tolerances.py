"""Tolerances of the tests, each once and with its reason.

A test that needs another tolerance states it in place.
"""

from __future__ import annotations

TWIN = 1e-4
"""Shader against float64 twin, of the value's scale: float32 and fast exp, pow and sqrt stay far under."""

PUBLISHED = 1e-9
"""Closed forms against tables printed with 16 digits, relative."""

LOBE_TWIN = 1e-5
"""Surface lobes and their albedos, shader against float64 twin, of the value's scale."""

RECIPROCAL = 1e-6
"""Change of a lobe when light and view change places, of its largest value."""

QUADRATURE = 0.001
"""Directional albedos against independent ones, relative; V-cavities have a crease, others are 1e-7."""

FURNACE = 0.01
"""White skin under light from everywhere alike against 1: what the tables of albedo cost."""

FURNACE_OF_HAIR = 1.02
"""Greatest radiance of hair under light of 1 from everywhere alike."""

TABLE_ALBEDO = 0.005
"""The shader's 64 x 32 table of the surface albedo, read between its texels, relative."""

TABLE_LOBE = 0.005
"""The shader's 512 x 512 Beckmann table, read between its texels, of the lobe's peak."""

KERNEL_VARIANCE = 2e-4
"""Variance of a sampled kernel, in steps squared: linear steps of 1/64 between the table's rows."""

FLAT = 1e-4
"""Constant light stays constant under every blur, relative."""

SPREAD_PEAK = 0.01
"""A point of light beyond 1.5 texels against the analytic sum of Gaussians, of the peak."""

SPREAD_ENERGY = 0.002
"""Light that a blur loses or invents, relative."""

SPREAD_VARIANCE = 0.002
"""Second moment of a blurred point against the one asked for, relative: the stretch map holds halves."""

HALVES = 1e-3
"""Light in levels of halves against floats, relative: a half has 11 bits."""

HALVED = 0.002
"""Levels of less resolution against whole ones under hard edges of light, relative RMSE."""

SHEARED_PEAK = 0.03
"""A blurred point on a sheared map against the analytic one, of the peak: light is read between texels."""

SHEARED_VARIANCE = 0.03
"""Its second moments, along all directions alike, of the variance asked for."""

BUMPY_HIGHLIGHT = 0.03
"""Mean highlight of bumps narrower than a pixel against resolved bumps, relative: slopes are not normal."""

MAP_NORMAL = 1e-3
"""Normals from slopes stored as halves, between texels that a sampler weighs in 1/256."""

LIT = 1e-3
"""Visibility of what nothing hides, and of what is wholly hidden."""

CLOSED_FORM = 1e-6
"""The same closed form coded twice, or transformed and interpolated, relative."""

LAYERED_TOTAL = 0.014
"""Layered diffusion's total against Monte Carlo for three-layer skin, relative: a known bias of the model."""

STANDARD_ERRORS = 3.0
"""How far a count may lie from the truth: further happens to 1 in 370, and the seeds are fixed."""

CHANCE = 0.0027
"""Probability with which a right program fails one statistical test: that of three standard errors."""

PREFILTERED = 1e-3
"""Panoramas convolved in harmonics of degree 112 against plain sums over their texels, relative."""

PANORAMA = 1e-3
"""Panoramas read in a direction, shader against float64 twin, of the scale: acos and atan2 are coarse."""

AREA_LIGHT = 0.01
"""Irradiance of a light with a size, shaded as a few lights, against its closed form, of the largest."""

SLAB_THROUGH = 0.003
"""Light through a slab against the profile, of all its light: places are a millimetre apart."""

WHITE_THIN = 0.01
"""Share of the light that a white sheet in even light may give too much or too little."""

OCCLUSION = 0.04
"""Visible fraction of the sky by 128 directions against closed forms: one direction is up to 0.03 of it."""

FOLLOWED = 0.03
"""RMS difference between occlusion that follows a shape and one baked for it, by 64 directions."""

STILL = 1e-3
"""Change of the occlusion of a head that does not move: its points move within their texels."""

SEAM = 0.01
"""Jump of the scattered light across a seam, of the light there."""

PICTURE_MEAN, PICTURE_TAIL = 0.4, 4.0
"""Whole frames against stored pictures, in bytes, in the mean and at the 99.5th percentile: other versions of
the software adapter round otherwise."""

SHAPE, SHAPE_NORMAL = 2e-6, 2e-5
"""Points and tangents computed on the device against float64, of the largest; normals, by component."""

WALKED = 0.05
"""Where a gutter continues, walked in single precision, against walks in float64 [texel]."""

STRETCHED = 1.5e-3
"""Stretch on the device against the atlas' own, of the largest: both are halves, one of them of weights in
steps of 1/65535."""

HARMONIC = 0.003
"""Share of light in proportion to x that a Gaussian leaves on a ball, against the heat equation's."""

POSED = 0.005
"""A picture of a posed head against one of a head loaded in that shape, relative root mean square."""

INTEGRATING_SPHERE = {0.3: 0.03, 0.6: 0.1}
"""Light by bounces in a sphere by its albedo, relative: five bounces of all, and shares of few lines."""

FURNACE_OF_LINKS = 0.015
"""White skin in a corner under light from everywhere alike against 1, in the mean: five bounces."""

COUNTED_TOTAL = 0.002
"""What half-spaces return by tables of photons against H-functions, relative: three million photons."""

COUNTED_RINGS = 0.04
"""Light through rings by tables of photons against photons of another run, relative: the noise of both."""

COUNTED_FLESH = 0.08
"""Density of the medium that a counted profile stands for, relative: six Gaussians are not quite as wide."""

FORWARD_AMOUNT = 0.004
"""Shares of light that slabs of forward scattering return and let through: eight cosines and terms."""

FORWARD_CONTINUOUS = 0.005
"""Laws of a mean cosine of next to 0 against those of 0, relative: one by nodes, the other by H-functions."""

PRINTED = 1e-6
"""Computed figures in a text, relative, beside one in the last digit: processors add in other orders."""

UNMIXED = 0.03
"""Melanin and blood found in a colour of known skin, relative: the table is linear between its nodes."""

SITE_MEDIAN = 1.0
"""Median L*, a*, b* of drawn people at a site against the archive's: the noise of 50 people is as large."""

SITE_PAINTED = 1.5
"""Painted colour around a measured site against that of its pigments, CIELAB: zones fall off around it."""

TONE_PARITY = 0.01
"""Difference between skin tones of the relative error of light after exposure and tone curve."""

SWUNG_LENGTHS = 1e-5
"""Lengths of the segments of guides that swing, relative: float32."""

SWUNG_KNOTS_MM = 0.01
"""Knots of guides that swing: at rest, against a twin in float64 after a few frames, and in the skin [mm]."""

WRITTEN_CURVES_MM = 1e-3
"""Knots of hair in files of other programs against the head's, by seven digits [mm]."""

SPECTRAL_COLOUR = 0.3
"""Median CIEDE2000 of a picture from spectra under D65 against one in red, green and blue: products of
colours differ from colours of products."""

SPECTRUM = 0.005
"""Spectrum of a flat patch against the layered model, relative: six Gaussians are fitted to its profile."""

OXYGEN = 0.05
"""Oxygen saturation by two wavelengths, relative: the paths of light depend a little on pigments."""

POLARISED = 0.01
"""Parallel minus cross-polarised light against the reflection, relative to its mean: float32."""
