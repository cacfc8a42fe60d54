"""Export of skins and heads to other programs, with an estimate of the remaining error."""
