"""From a recording and an experiment to a diagnosis: what the command, notebooks, studies do."""
