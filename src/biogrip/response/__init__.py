"""How the gripper turns while it squeezes a sample."""
