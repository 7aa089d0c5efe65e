"""What a run saved, read for its report, and the rows, figures and words that several sections show."""
