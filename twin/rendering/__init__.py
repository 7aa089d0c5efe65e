"""Pictures and videos of the robot."""
