"""The experiment: sample models, torque protocols, sampling and noise."""
