"""Scenario files: read, validated, extended, overridden, written."""
