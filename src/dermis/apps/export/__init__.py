"""Export of skins and heads to other programs, with predicted errors of the skin that a program renders."""
