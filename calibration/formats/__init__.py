"""Laboratory formats: C3D, CSV and ROS bags, both ways."""
