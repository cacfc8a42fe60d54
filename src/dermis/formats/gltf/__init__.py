"""Reading and writing of glTF 2.0 heads with their deformation."""
