"""From pictures to skin and light: unmixing of colour maps and fits of photographs."""
