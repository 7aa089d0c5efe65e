"""What laboratory files show by themselves, and a mapping file drafted from it."""
