"""Running a study with Snakemake: records of files, locks, signals, export."""
