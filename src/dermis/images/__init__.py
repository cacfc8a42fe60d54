"""Pictures: pixels read and written, colour spaces, filters and movies."""
