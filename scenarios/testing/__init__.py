"""Fixtures and assertions for other people's test suites."""
