"""The pytest plugin for test suites of calibration code; the wheel has it as the module `tiago_twin_pytest`."""
