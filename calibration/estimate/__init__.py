"""An estimate and its files."""
