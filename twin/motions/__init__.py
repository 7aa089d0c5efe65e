"""What the joints and the base are commanded to do."""
