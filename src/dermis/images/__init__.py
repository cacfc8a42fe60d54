"""Pictures: picture files, colour spaces, filters and movies."""
