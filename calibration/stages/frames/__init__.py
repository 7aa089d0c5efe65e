"""Stages base_frame and arm_tool: frames of a mobile manipulator after Heins (2022)."""
