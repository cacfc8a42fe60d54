"""Export to Unreal Engine: a script for the editor that creates a SubsurfaceProfile asset."""
