"""Stages registration and geometry: marker frames, joint placements, zeros, compliance."""
