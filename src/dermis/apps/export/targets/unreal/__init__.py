"""Export to Unreal Engine: a script for the editor that creates a subsurface profile."""
