"""Recordings: the dataset folder, its trials and their files."""
