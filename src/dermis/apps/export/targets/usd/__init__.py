"""Export to USD: a stage with the head, what moves it, its hairs and its materials."""
