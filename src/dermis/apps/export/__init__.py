"""Export of skins and heads to other programs, with the predicted error of each program's skin."""
