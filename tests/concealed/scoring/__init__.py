"""Scores what was said of concealed cases against what was concealed."""
