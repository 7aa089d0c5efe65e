"""The stages of a calibration, in the order of the pipeline."""
