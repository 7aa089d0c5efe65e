"""Laboratory formats, in and out: C3D, CSV and ROS bags. Only here are units, signs and frames of others converted."""
