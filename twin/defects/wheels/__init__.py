"""The wheels under the base: bushings, contacts, rolling."""
