"""One robot in its laboratory: its dataset and its truth."""
