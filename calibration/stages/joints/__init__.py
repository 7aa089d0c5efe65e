"""Stage joints: the paper's sigmoid-polynomial joint models."""
