"""One trial in three dimensions, as one HTML file; needs the extra `view`."""
