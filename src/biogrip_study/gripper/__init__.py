"""What only the study simulates of the gripper: nonlinear arms, loss of contact, calibration."""
