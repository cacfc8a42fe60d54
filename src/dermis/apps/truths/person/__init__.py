"""People by path tracing: coated skin, eyes with real refraction, teeth and hairs as Mitsuba has them."""
