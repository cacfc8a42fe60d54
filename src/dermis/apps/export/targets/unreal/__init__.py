"""Export to Unreal Engine: a subsurface profile made by an editor script."""
