"""Scoring of answers on concealed cases against the truth."""
