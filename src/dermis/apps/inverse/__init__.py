"""Estimation of skin and light from pictures: unmixing of colour maps, and fits to photographs."""
