"""The experiment: what is gripped, with which torque, and what noise adds."""
