"""Constructor calls for mypy: valid ones, and invalid ones, where an unused `ignore` is an error."""

from __future__ import annotations

import dermis
from dermis.mesh.head import Head


def right(head: Head) -> list[object]:
    return [
        dermis.Skin(oiliness=0.5, pigments=None),
        dermis.Settings(size=(64, 64), exposure="auto", background=(0.1, 0.1, 0.1)),
        dermis.Camera((0.0, 0.0, 900.0), frame_mm=200.0),
        dermis.Environment("uniform", rotation_degrees=30.0),
        dermis.SpotLight((0.0, 300.0, 900.0), outer_degrees=20.0),
        dermis.DirectionalLight(direction=(0.0, -1.0, 0.0)),
        dermis.Human(skin=dermis.SkinLook(freckles=0.4), eyes=dermis.EyeLook(), hair=dermis.HairLook()),
        dermis.Pose(weights={"jawOpen": 0.4}),
        dermis.Scene("human", lights="window", camera="profile", skin={"mix": 0.2}, environment="uniform"),
        dermis.Scene(head, lights=dermis.studio(), camera=dermis.side, pose={"jawOpen": 0.4}),
    ]


def wrong(head: Head) -> list[object]:
    return [
        dermis.Skin(oilines=0.5),  # type: ignore[call-arg]
        dermis.Skin(oiliness="much"),  # type: ignore[arg-type]
        dermis.Skin(specular_colour="black"),  # type: ignore[arg-type]
        dermis.Skin("dark"),  # type: ignore[call-arg]
        dermis.Settings(resolution=(64, 64)),  # type: ignore[call-arg]
        dermis.Camera((0.0, 0.0, 900.0), (0.0, 0.0, 0.0)),  # type: ignore[call-arg]
        dermis.Environment(),  # type: ignore[call-arg]
        dermis.PointLight(irradiance=(3.0, 3.0, 3.0)),  # type: ignore[call-arg]
        dermis.StripeLight((0.0, 0.0, 1.0), width="1.5"),  # type: ignore[call-arg]
        dermis.SkinLook(freckle=0.4),  # type: ignore[call-arg]
        dermis.Scene(head, camera=900.0),  # type: ignore[arg-type]
        dermis.Scene(head, light="window"),  # type: ignore[call-arg]
    ]
