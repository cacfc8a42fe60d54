"""Export to OpenPBR and Standard Surface as MaterialX documents."""
