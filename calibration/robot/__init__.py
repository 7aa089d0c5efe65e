"""The nominal robot: chain, kinematics, gravity torques, hand, frames."""
