"""What recordings cannot be: wrong units, joints, plates, currents."""
