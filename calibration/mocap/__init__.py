"""Motion capture: marker labels, cluster shapes and poses, postures of the hand."""
