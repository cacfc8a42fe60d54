"""Export to Mitsuba 3: a scene whose skin is a homogeneous medium."""
