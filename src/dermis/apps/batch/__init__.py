"""Data sets: many pictures of people with what is known about each, on one machine or many."""
