"""From a specification and defects to states."""
