"""Export of skins and heads to other programs, with the predicted errors of each program's rendering."""
