"""Rotation of the gripper's arms while they squeeze a sample."""
