"""Applications: what people do with frames."""
