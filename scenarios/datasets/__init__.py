"""Many runs of one scenario: made by this process, by workers or by a cluster; resumable, with an index."""

from scenarios.datasets.reader import Collection, Run, open_collection

__all__ = ["Collection", "Run", "open_collection"]
