"""An estimate against the truth."""
