"""The mapping from laboratory files to channels of a trial."""
