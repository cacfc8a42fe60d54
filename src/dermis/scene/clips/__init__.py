"""Motion from files: animation clips, face captures, sequences of meshes."""
