"""The programs that skin is exported to: each module without an underscore in its name has a `TARGET`."""
