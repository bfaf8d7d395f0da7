"""Where things are in the repository."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
CONFIG = ROOT / "config" / "config.yaml"
EXAMPLE = ROOT / "data" / "example_trace.csv"
EXAMPLE_TRUTH = ROOT / "data" / "example_truth.yaml"
