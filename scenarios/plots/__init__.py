"""Plots of results: each function takes data and an `ax`, draws and returns it; none reads a file or shows a window."""
