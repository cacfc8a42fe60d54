"""Search for pairs of surface cells between which light passes through thin tissue, by shaders."""
