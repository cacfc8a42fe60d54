"""From the colours of skin back to what it is made of."""
