"""Monte-Carlo studies over many robots."""
