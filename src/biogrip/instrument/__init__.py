"""The instrument: gripper, comb drive and calibration."""
