"""Held-out errors of predictions."""
