"""Pictures: reading and writing of files, colour spaces, filters and movies."""
