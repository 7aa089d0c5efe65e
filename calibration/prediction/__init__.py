"""Predictions: the ladder's rows, the base's pose, the compensator."""
